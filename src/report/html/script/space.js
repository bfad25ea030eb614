// Points, board and cameras in the board's frame (x along its rows, y down, z away from the viewer), drawn point by
// point into an image with a depth of its own. That takes a few milliseconds on any machine, with or without a graphics
// card, and looks the same everywhere.
if (closeups) {
  const { scene } = closeups;
  const canvas = document.getElementById("space-view");
  const context = canvas.getContext("2d");
  const words = document.getElementById("space-words");
  const [columns, rows, square_m] = scene.board;
  const center = [(columns * square_m) / 2, (rows * square_m) / 2, 0];
  const SIDES = { oblique: [0.75, 0.45], edge: [1.5708, 0], front: [0, 0] };
  const START = { yaw: SIDES.oblique[0], pitch: SIDES.oblique[1], distance: 0.62, target: center };

  let view = { ...START };
  let state = 0;
  let shown = null;
  let clouds = new Map();
  let ids = null;

  // --- What there is to draw ---

  const { ray, belongs } = closeups;
  const place = (pose, point) => closeups.place(state, pose, point);

  const cloud_of = (frame) => {
    const key = `${frame.frame} ${state}`;
    if (!clouds.has(key)) {
      const { scale, bias_m, moved } = scene.states[state];
      const pose = scene.poses[frame.frame][state];
      const points = [];
      const pixels = [];
      // Which kept pixel of the photo has a point's colour.
      const colours = [];
      for (let i = 0; pose && i < frame.depth_m.length; i++) {
        const z = (frame.depth_m[i] - bias_m) / scale;
        if (z !== z) continue;
        const [x, y] = belongs(moved, (i % frame.columns) * frame.step, Math.floor(i / frame.columns) * frame.step);
        const direction = ray(scene.states[state], x, y);
        if (!direction) continue;
        points.push(...place(pose, [direction[0] * z, direction[1] * z, z]));
        pixels.push(i);
        const [column, row] = [x, y].map((at) => Math.round(at / frame.step));
        const is_inside = column >= 0 && row >= 0 && column < frame.columns && row < frame.rows;
        colours.push(is_inside ? row * frame.columns + column : -1);
      }
      clouds.set(key, { points: new Float32Array(points), pixels: new Uint32Array(pixels), colours: new Int32Array(colours) });
    }
    return clouds.get(key);
  };

  const facing = (frame) => closeups.facing(state, frame);

  const pyramid = (pose, size_m) => {
    const corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(([x, y]) => {
      const direction = ray(scene.states[state], x * (scene.size_px[0] - 1), y * (scene.size_px[1] - 1));
      const [u, v] = direction ?? [x - 0.5, 0.75 * (y - 0.5)];
      return place(pose, [u * size_m, v * size_m, size_m]);
    });
    const tip = place(pose, [0, 0, 0]);
    return corners.flatMap((corner, k) => [[tip, corner], [corner, corners[(k + 1) % 4]]]);
  };

  // --- Drawing ---

  // Axes of the eye in the board's frame: right, down, forward.
  const axes = () => {
    const [cy, sy, cp, sp] = [Math.cos(view.yaw), Math.sin(view.yaw), Math.cos(view.pitch), Math.sin(view.pitch)];
    const right = [cy, 0, -sy];
    const forward = [sy * cp, sp, cy * cp];
    const down = [-sy * sp, cp, -cy * sp];
    return { right, down, forward };
  };
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

  // A colour of the style sheet as numbers, for the theme that is on.
  const swatch = document.createElement("i");
  swatch.hidden = true;
  canvas.after(swatch);
  const colour_at = (name) => {
    swatch.style.color = `var(${name})`;
    return getComputedStyle(swatch).color.match(/\d+/g).slice(0, 3).map(Number);
  };

  let waiting = false;
  const draw = () => {
    if (!waiting) requestAnimationFrame(render);
    waiting = true;
  };

  const render = () => {
    waiting = false;
    // Half the screen's pixels are enough for points, and no screen is too large to turn smoothly.
    const width = Math.min(900, Math.max(240, Math.round(canvas.clientWidth)));
    const height = Math.round((width * canvas.clientHeight) / Math.max(canvas.clientWidth, 1));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const image = context.createImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    const nearness = new Float32Array(width * height);
    ids = new Int32Array(width * height).fill(-1);
    const pack = ([r, g, b]) => (255 << 24) | (b << 16) | (g << 8) | r;
    pixels.fill(pack(colour_at("--stage")));
    const { right, down, forward } = axes();
    const eye = [0, 1, 2].map((k) => view.target[k] - view.distance * forward[k]);
    const focal = 0.9 * Math.max(width, height);
    const project = (x, y, z) => {
      const [dx, dy, dz] = [x - eye[0], y - eye[1], z - eye[2]];
      const depth = forward[0] * dx + forward[1] * dy + forward[2] * dz;
      if (depth < 0.01) return null;
      return [
        width / 2 + (focal * (right[0] * dx + right[1] * dy + right[2] * dz)) / depth,
        height / 2 + (focal * (down[0] * dx + down[1] * dy + down[2] * dz)) / depth,
        1 / depth,
      ];
    };
    const dab = (x, y, near, size, colour, id) => {
      const [x0, y0] = [Math.round(x - size / 2), Math.round(y - size / 2)];
      for (let py = Math.max(0, y0); py < Math.min(height, y0 + size); py++) {
        for (let px = Math.max(0, x0); px < Math.min(width, x0 + size); px++) {
          const at = py * width + px;
          if (near <= nearness[at]) continue;
          nearness[at] = near;
          pixels[at] = colour;
          ids[at] = id;
        }
      }
    };
    const line = (from, to, size, colour) => {
      const [a, b] = [project(...from), project(...to)];
      if (!a || !b) return;
      const steps = Math.min(4000, Math.ceil(Math.max(Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1]), 1)));
      for (let i = 0; i <= steps; i++) {
        const t = i / steps;
        // A hair nearer than what it lies on, so that points of the same surface do not eat it.
        dab(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), (a[2] + t * (b[2] - a[2])) * 1.0005, size, colour, -1);
      }
    };

    const { points, pixels: sources, colours } = cloud_of(shown);
    const by_distance = document.querySelector("[name=space-colour]:checked").value === "distance";
    const rgba = shown.rgba;
    const side = facing(shown);
    // Points grow as they come nearer, so that a surface stays closed.
    const footprint = (shown.step * focal) / scene.size_px[0] * 1.3;
    for (let i = 0; i < sources.length; i++) {
      const z = points[3 * i + 2];
      const p = project(points[3 * i], points[3 * i + 1], z);
      if (!p || p[0] < 0 || p[1] < 0 || p[0] >= width || p[1] >= height) continue;
      const source = sources[i];
      let colour = 0xff888888;
      if (by_distance) {
        colour = pack(closeups.colour_of_distance(side * z));
      } else if (rgba && colours[i] >= 0) {
        const at = 4 * colours[i];
        colour = pack([rgba[at], rgba[at + 1], rgba[at + 2]]);
      }
      const size = Math.max(1, Math.min(5, Math.round(footprint * shown.depth_m[source] * p[2])));
      dab(p[0], p[1], p[2], size, colour, i);
    }

    const grid = pack(colour_at("--grid-lines"));
    for (let i = 0; i <= columns; i++) {
      line([i * square_m, 0, 0], [i * square_m, rows * square_m, 0], i % columns ? 1 : 2, grid);
    }
    for (let i = 0; i <= rows; i++) {
      line([0, i * square_m, 0], [columns * square_m, i * square_m, 0], i % rows ? 1 : 2, grid);
    }
    if (document.getElementById("space-cameras").checked) {
      const [faint, strong] = [pack(colour_at("--cameras")), pack(colour_at("--fault"))];
      for (const [frame, poses] of scene.poses.entries()) {
        if (!poses[state]) continue;
        const is_here = frame === shown.frame;
        for (const [from, to] of pyramid(poses[state], is_here ? 0.03 : 0.018)) {
          line(from, to, is_here ? 2 : 1, is_here ? strong : faint);
        }
      }
    }
    context.putImageData(image, 0, 0);
    // For tests and for the curious.
    canvas.dataset.points = String(sources.length);
    canvas.dataset.view = [view.yaw, view.pitch, view.distance, ...view.target].map((v) => v.toFixed(4)).join(" ");
    canvas.dataset.state = String(state);
  };

  // --- Reacting ---

  const turn = (yaw, pitch) => {
    view.yaw += yaw;
    view.pitch = Math.max(-1.5, Math.min(view.pitch + pitch, 1.5));
    draw();
  };
  const zoom = (factor) => {
    view.distance = Math.max(0.05, Math.min(view.distance / factor, 4));
    draw();
  };
  // Moves the target so that what lies there follows the pointer.
  const move = (dx, dy) => {
    const { right, down } = axes();
    const scale = view.distance / (0.9 * Math.max(canvas.clientWidth, canvas.clientHeight));
    view.target = view.target.map((v, k) => v - scale * (dx * right[k] + dy * down[k]));
    draw();
  };
  const reset = (side = "oblique") => {
    const [yaw, pitch] = SIDES[side];
    view = { ...START, yaw, pitch };
    draw();
  };

  const fingers = new Map();
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    tip.hide();
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return pick(event);
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    fingers.set(event.pointerId, now);
    if (fingers.size === 2) {
      const [other] = [...fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const apart = (place) => Math.max(8, Math.hypot(place[0] - other[0], place[1] - other[1]));
      zoom(apart(now) / apart(before));
      move(dx / 2, dy / 2);
    } else if (event.buttons & 6 || event.shiftKey) move(dx, dy);
    else turn(0.008 * dx, 0.008 * dy);
  });
  const lift = (event) => fingers.delete(event.pointerId);
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("pointerleave", () => tip.hide());
  canvas.addEventListener("wheel", (event) => {
    // Without a modifier the page scrolls, unless the reader has clicked into the drawing.
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const move_by = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[event.key];
    const act = {
      "+": () => zoom(1.15), "=": () => zoom(1.15), "-": () => zoom(1 / 1.15), Home: () => reset(),
    }[event.key];
    if (move_by && event.shiftKey) move(...move_by);
    else if (move_by) turn(0.006 * move_by[0], 0.006 * move_by[1]);
    else if (act) act();
    else return;
    event.preventDefault();
  });

  // The number under the pointer.
  const pick = (event) => {
    const box = canvas.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * canvas.width);
    const y = Math.floor(((event.clientY - box.top) / box.height) * canvas.height);
    const id = ids?.[y * canvas.width + x] ?? -1;
    if (id < 0) return tip.hide();
    const { points, pixels } = cloud_of(shown);
    const source = pixels[id];
    const [px, py] = [(source % shown.columns) * shown.step, Math.floor(source / shown.columns) * shown.step];
    const off_mm = 1000 * points[3 * id + 2] * facing(shown);
    const side = off_mm < 0 ? "in front of" : "behind";
    const [left, top] = [event.clientX, event.clientY - 6];
    tip.show(
      `(${px}, ${py}) px: ${(1000 * shown.depth_m[source]).toFixed(1)} mm deep, ` +
        `${Math.abs(off_mm).toFixed(1)} mm ${side} the board's plane`,
      { left, right: left, top, bottom: top + 20 },
    );
  };

  const say = () => {
    words.textContent = `Frame ${shown.frame}, ${scene.states[state].label}. ${shown.words[state]}`;
  };
  document.getElementById("space").addEventListener("change", (event) => {
    if (event.target.name === "space-state") {
      state = Number(event.target.value);
      closeups.see(state);
    }
    if (event.target.name === "space-colour") {
      document.getElementById("space-scale").hidden = event.target.value !== "distance";
    }
    say();
    draw();
  });
  document.getElementById("space-sides").addEventListener("click", (event) => {
    const { side, zoom: factor } = event.target.dataset;
    if (side) reset(side);
    if (factor) zoom(Number(factor));
  });
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  document.getElementById("theme").addEventListener("click", draw);
  closeups.watch((frame) => {
    shown = frame;
    say();
    draw();
    closeups.colours(frame).then(draw);
  });
}
