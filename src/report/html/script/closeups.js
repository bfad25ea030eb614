// The frames that can be looked at closely: depth as numbers, colour as pixels, and which of them is shown.
const closeups = (() => {
  const element = document.getElementById("scene-data");
  if (!element) return null;
  const scene = JSON.parse(element.textContent);
  const listeners = [];
  let at = 0;

  // 16-bit little-endian numbers to metres; 0 is "no measurement" and becomes NaN.
  const depths = (text, unit_m) => {
    const bytes = atob(text);
    const depth_m = new Float32Array(bytes.length / 2);
    for (let i = 0; i < depth_m.length; i++) {
      const steps = bytes.charCodeAt(2 * i) | (bytes.charCodeAt(2 * i + 1) << 8);
      depth_m[i] = steps === 0 ? NaN : steps * unit_m;
    }
    return depth_m;
  };

  for (const frame of scene.frames) {
    frame.depth_m = depths(frame.depth, scene.unit_m);
    frame.image = document.getElementById(`photo-${frame.frame}`);
    delete frame.depth;
  }

  // The colour of every kept pixel of the depth, as RGBA bytes; read once.
  const colours = async (frame) => {
    if (!frame.rgba) {
      frame.image.loading = "eager";
      await frame.image.decode();
      const canvas = document.createElement("canvas");
      canvas.width = frame.columns;
      canvas.height = frame.rows;
      const context = canvas.getContext("2d", { willReadFrequently: true });
      context.drawImage(frame.image, 0, 0, frame.columns, frame.rows);
      frame.rgba = context.getImageData(0, 0, frame.columns, frame.rows).data;
    }
    return frame.rgba;
  };

  // x/z and y/z of a pixel, interpolated between the nodes of the state's grid.
  const ray = ({ nodes: [n, m], rays }, x, y) => {
    const gx = (x / (scene.size_px[0] - 1)) * (n - 1);
    const gy = (y / (scene.size_px[1] - 1)) * (m - 1);
    // Beside the image the nearest cell goes on: a moved depth map reaches there.
    const [i, j] = [[gx, n], [gy, m]].map(([at, nodes]) => Math.max(0, Math.min(Math.floor(at), nodes - 2)));
    const [a, b, c, d] = [rays[j * n + i], rays[j * n + i + 1], rays[(j + 1) * n + i], rays[(j + 1) * n + i + 1]];
    if (!a || !b || !c || !d) return null;
    const [u, v] = [gx - i, gy - j];
    return [0, 1].map((k) => (1 - v) * ((1 - u) * a[k] + u * b[k]) + v * ((1 - u) * c[k] + u * d[k]));
  };

  // R' (x - t): from the colour camera's frame to the board's.
  const to_board = (pose, [x, y, z]) => {
    const [a, b, c] = [x - pose[9], y - pose[10], z - pose[11]];
    return [0, 1, 2].map((k) => pose[k] * a + pose[3 + k] * b + pose[6 + k] * c);
  };

  // In a state's world: where images are mirrored back, what was behind the board is before it.
  const place = (state, pose, point) => {
    const [x, y, z] = to_board(pose, point);
    return [x, y, scene.states[state].mirrored ? -z : z];
  };

  // 1 where the camera stands before the board, −1 where a mirrored image makes it seem to stand behind.
  const facing = (state, frame) => {
    const pose = scene.poses[frame.frame][state];
    return pose && place(state, pose, [0, 0, 0])[2] > 0 ? -1 : 1;
  };

  // The pixel of the colour image to which a pixel of the depth map belongs.
  const belongs = (moved, x, y) => {
    if (!moved) return [x, y];
    const from = [moved.mirrored ? scene.size_px[0] - 1 - x : x, y];
    return [0, 1].map((k) => moved.center_px[k] + moved.zoom * (from[k] - moved.shift_px[k] - moved.center_px[k]));
  };

  // How far a depth pixel's point is from the board's plane, metres: from in front (negative) to behind; NaN where it
  // has none.
  const distance_m = (state, frame, i) => {
    const pose = scene.poses[frame.frame][state];
    const { scale, bias_m, moved } = scene.states[state];
    const z = (frame.depth_m[i] - bias_m) / scale;
    if (!pose || z !== z) return NaN;
    const [x, y] = belongs(moved, (i % frame.columns) * frame.step, Math.floor(i / frame.columns) * frame.step);
    const direction = ray(scene.states[state], x, y);
    return direction ? facing(state, frame) * place(state, pose, [direction[0] * z, direction[1] * z, z])[2] : NaN;
  };

  // From in front of the board to behind it.
  const DISTANCES = [[196, 81, 26], [240, 170, 120], [225, 225, 225], [120, 180, 225], [0, 90, 160]];
  const DISTANCE_RANGE_M = 0.02;
  const colour_of_distance = (off_m) => {
    const at = ((Math.max(-1, Math.min(off_m / DISTANCE_RANGE_M, 1)) + 1) / 2) * (DISTANCES.length - 1);
    const k = Math.min(Math.floor(at), DISTANCES.length - 2);
    return DISTANCES[k].map((from, c) => Math.round(from + (at - k) * (DISTANCES[k + 1][c] - from)));
  };

  let state = 0;
  const tell = () => {
    for (const listener of listeners) listener(scene.frames[at], at);
  };
  const choose = (index) => {
    at = index;
    tell();
  };
  document.getElementById("closeup-frames").addEventListener("change", (event) => choose(Number(event.target.value)));

  return {
    scene,
    colours,
    ray,
    belongs,
    place,
    facing,
    distance_m,
    colour_of_distance,
    // Before or after the correction: which of the scene's states is looked at.
    state: () => state,
    see(index) {
      state = index;
      tell();
    },
    // Calls `listener` with the frame now and whenever another is chosen.
    watch(listener) {
      listeners.push(listener);
      listener(scene.frames[at], at);
    },
  };
})();
