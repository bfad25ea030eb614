// Frames, large; the arrow keys or a swipe leaf through them, and a corner tells its numbers.
{
  const figures = [...document.querySelectorAll(".frames figure")];
  if (figures.length > 0) {
    const dialog = document.createElement("dialog");
    dialog.setAttribute("aria-label", "Frame");
    const place = document.createElement("figure");
    const steps = document.createElement("div");
    steps.className = "steps";
    let at = 0;
    const show = (index) => {
      at = (index + figures.length) % figures.length;
      const parts = figures[at].querySelectorAll(".picture, figcaption");
      place.replaceChildren(...[...parts].map((part) => part.cloneNode(true)));
      place.querySelector("img").removeAttribute("id");
      tip.hide();
    };
    for (const [words, act] of [
      ["← Previous", () => show(at - 1)],
      ["Close", () => dialog.close()],
      ["Next →", () => show(at + 1)],
    ]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = words;
      button.addEventListener("click", act);
      steps.append(button);
    }
    dialog.append(place, steps);
    dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
    dialog.addEventListener("close", () => {
      tip.hide();
      figures[at].querySelector(".zoom").focus({ preventScroll: true });
    });
    dialog.addEventListener("keydown", (event) => {
      if (event.key === "ArrowLeft") show(at - 1);
      if (event.key === "ArrowRight") show(at + 1);
    });
    let from = null;
    place.addEventListener("pointerdown", (event) => (from = event.clientX));
    place.addEventListener("pointerup", (event) => {
      const way = from === null ? 0 : event.clientX - from;
      from = null;
      if (event.pointerType === "touch" && Math.abs(way) > 50) show(at - Math.sign(way));
    });
    place.addEventListener("pointermove", (event) => {
      const rings = [...place.querySelectorAll(".overlay-corners circle")];
      const ring = nearest(rings, event.clientX, event.clientY);
      if (!ring) return tip.hide();
      const id = place.querySelectorAll(".overlay-ids text")[rings.indexOf(ring)].textContent;
      const [x, y] = [ring.getAttribute("cx"), ring.getAttribute("cy")];
      tip.show(`corner ${id} at (${x}, ${y}) px`, ring.getBoundingClientRect());
    });
    place.addEventListener("pointerleave", () => tip.hide());
    document.body.append(dialog);
    for (const [index, figure] of figures.entries()) {
      figure.querySelector(".zoom").addEventListener("click", () => {
        show(index);
        dialog.showModal();
      });
    }
  }
}
