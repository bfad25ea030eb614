// Two pictures on top of each other, and a line between them that a slider, a pointer or a finger moves.
if (closeups) {
  // From near to far: dark blue to yellow, apart for the colour-blind, ordered in grey (after viridis).
  const RAMP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  const HOLE = [128, 128, 128];
  const EDGES = { left: [255, 122, 26], right: [60, 170, 255] };

  const ramp = (share) => {
    const at = Math.max(0, Math.min(share, 1)) * (RAMP.length - 1);
    const i = Math.min(Math.floor(at), RAMP.length - 2);
    return RAMP[i].map((from, c) => from + (at - i) * (RAMP[i + 1][c] - from));
  };

  // The depths between which 96 of 100 lie.
  const range_of = (depth_m) => {
    const sorted = depth_m.filter((z) => z === z).sort();
    const pick = (share) => sorted[Math.floor(share * (sorted.length - 1))];
    return sorted.length > 0 ? [pick(0.02), pick(0.98)] : [0, 1];
  };

  const paint = (canvas, frame, colour_of) => {
    canvas.width = frame.columns;
    canvas.height = frame.rows;
    const context = canvas.getContext("2d");
    const image = context.createImageData(frame.columns, frame.rows);
    for (let i = 0; i < frame.depth_m.length; i++) {
      const colour = colour_of(i);
      if (colour) image.data.set([...colour, 255], 4 * i);
    }
    context.putImageData(image, 0, 0);
  };

  const paint_depth = ([canvas], frame) => {
    const [near, far] = range_of(frame.depth_m);
    paint(canvas, frame, (i) => {
      const z = frame.depth_m[i];
      return z === z ? ramp((z - near) / (far - near)) : HOLE;
    });
    const scale = canvas.closest("figure").querySelector(".scale-of-colours");
    scale.querySelector(".near").textContent = `${(1000 * near).toFixed(0)} mm`;
    scale.querySelector(".far").textContent = `${(1000 * far).toFixed(0)} mm away`;
  };

  const over = document.getElementById("over");
  const shows_distance = () => over.querySelector("[name=over-shows]:checked").value === "distance";
  const paint_distance = ([canvas], frame) => {
    const state = closeups.state();
    paint(canvas, frame, (i) => {
      const off_m = closeups.distance_m(state, frame, i);
      return off_m === off_m ? closeups.colour_of_distance(off_m) : HOLE;
    });
  };
  const paint_over = (canvases, frame) => {
    const is_distance = shows_distance();
    (is_distance ? paint_distance : paint_depth)(canvases, frame);
    const [of_depth, of_distance] = over.querySelectorAll(".scale-of-colours");
    of_depth.hidden = is_distance;
    of_distance.hidden = !is_distance;
    over.querySelector("output").textContent = is_distance ? closeups.scene.states[closeups.state()].label : "";
  };

  // On a plane the reciprocal of depth is linear in the pixels, at whatever tilt, so its second difference shows where
  // the surface bends or jumps. What is large is told by how large it mostly is.
  const paint_edges = (canvases, frame) => {
    const { columns, rows, depth_m } = frame;
    const REACH = 3;
    const bend = new Float32Array(depth_m.length).fill(NaN);
    for (let y = REACH; y < rows - REACH; y++) {
      for (let x = REACH; x < columns - REACH; x++) {
        const i = y * columns + x;
        const across = 1 / depth_m[i - REACH] + 1 / depth_m[i + REACH] - 2 / depth_m[i];
        const down = 1 / depth_m[i - REACH * columns] + 1 / depth_m[i + REACH * columns] - 2 / depth_m[i];
        bend[i] = Math.hypot(across, down) * depth_m[i];
      }
    }
    const sorted = bend.filter((b) => b === b).sort();
    const limit = Math.max(6 * (sorted[sorted.length >> 1] ?? 0), 0.02);
    for (const canvas of canvases) {
      const side = canvas.parentElement.classList.contains("left") ? "left" : "right";
      paint(canvas, frame, (i) => (bend[i] > limit ? EDGES[side] : null));
    }
  };

  // Puts a canvas of kept depth pixels over the photo: each belongs to the first pixel of its block; with an alignment,
  // to where that says its colour is. In shares of the picture, so that it holds at every size.
  const lay = (canvas, frame, alignment) => {
    const zoom = alignment?.zoom ?? 1;
    const offset = [0, 1].map((axis) => {
      const center = (alignment?.center_px[axis] ?? 0) + 0.5;
      const shift = (alignment?.shift_px[axis] ?? 0) + (frame.step - 1) / 2;
      return (100 * (center * (1 - zoom) - zoom * shift)) / closeups.scene.size_px[axis];
    });
    canvas.style.transform = `translate(${offset[0]}%, ${offset[1]}%) scale(${zoom})`;
  };

  for (const [id, painter] of [["over", paint_over], ["edges", paint_edges]]) {
    const figure = document.getElementById(id);
    const [stage, image, slider] = [".stage", "img", "input[type=range]"].map((selector) => figure.querySelector(selector));
    const canvases = [...figure.querySelectorAll("canvas")];
    let frame = null;
    const cut = () => stage.style.setProperty("--cut", `${slider.value}%`);
    const place = (event) => {
      const box = stage.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    };
    const pull = (event) => {
      slider.value = 100 * place(event)[0];
      cut();
    };
    slider.addEventListener("input", cut);
    stage.addEventListener("pointerdown", (event) => {
      stage.setPointerCapture(event.pointerId);
      pull(event);
    });
    stage.addEventListener("pointermove", (event) => {
      if (event.buttons > 0) pull(event);
      const [x, y] = place(event).map((share, axis) => Math.floor(share * (axis ? frame.rows : frame.columns)));
      const z = frame.depth_m[y * frame.columns + x];
      const off_mm = 1000 * closeups.distance_m(closeups.state(), frame, y * frame.columns + x);
      const side = off_mm < 0 ? "in front of" : "behind";
      const off = off_mm === off_mm ? `, ${Math.abs(off_mm).toFixed(1)} mm ${side} the board's plane` : "";
      const words = z === z ? `${(1000 * z).toFixed(1)} mm${off}` : "no measurement";
      const [left, top] = [event.clientX, event.clientY - 6];
      tip.show(`(${x * frame.step}, ${y * frame.step}) px: ${words}`, { left, right: left, top, bottom: top + 20 });
    });
    stage.addEventListener("pointerleave", () => tip.hide());
    closeups.watch((chosen) => {
      frame = chosen;
      image.src = frame.image.src;
      stage.style.aspectRatio = `${closeups.scene.size_px[0]} / ${closeups.scene.size_px[1]}`;
      painter(canvases, frame);
      for (const canvas of canvases) {
        lay(canvas, frame, canvas.parentElement.classList.contains("right") ? closeups.scene.alignment : null);
      }
    });
    cut();
    figure.addEventListener("change", (event) => event.target.type === "radio" && painter(canvases, frame));
  }
}
