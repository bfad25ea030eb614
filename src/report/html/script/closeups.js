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

  const choose = (index) => {
    at = index;
    for (const listener of listeners) listener(scene.frames[at], at);
  };
  document.getElementById("closeup-frames").addEventListener("change", (event) => choose(Number(event.target.value)));

  return {
    scene,
    colours,
    // Calls `listener` with the frame now and whenever another is chosen.
    watch(listener) {
      listeners.push(listener);
      listener(scene.frames[at], at);
    },
  };
})();
