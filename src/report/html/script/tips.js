// Numbers: under the pointer, under a finger, and with the arrow keys once a figure has the focus.
const tip = (() => {
  const box = document.getElementById("tip");
  return {
    // Says `words` above a box on the screen, or below it where there is no room.
    show(words, { left, right, top, bottom }) {
      // Inside an open dialog nothing outside of it can be seen.
      (document.querySelector("dialog[open]") ?? document.body).append(box);
      box.textContent = words;
      box.hidden = false;
      const own = box.getBoundingClientRect();
      const x = (left + right) / 2 - own.width / 2;
      const above = top - own.height - 8;
      box.style.left = `${Math.max(6, Math.min(x, innerWidth - own.width - 6))}px`;
      box.style.top = `${above > 6 ? above : bottom + 8}px`;
    },
    hide() {
      box.hidden = true;
    },
  };
})();

// The element of `marks` nearest to a place on the screen, so that a finger need not hit a point of three pixels.
function nearest(marks, x, y) {
  let best = null;
  let reach = 24;
  for (const mark of marks) {
    const box = mark.getBoundingClientRect();
    const dx = Math.max(box.left - x, 0, x - box.right);
    const dy = Math.max(box.top - y, 0, y - box.bottom);
    const distance = Math.hypot(dx, dy);
    if (distance < reach) {
      best = mark;
      reach = distance;
    }
  }
  return best;
}

{
  let here = null;
  const hide = () => {
    here?.classList.remove("here");
    here = null;
    tip.hide();
  };
  const show = (mark) => {
    if (mark === here) return;
    hide();
    here = mark;
    mark.classList.add("here");
    tip.show(mark.dataset.tip, mark.getBoundingClientRect());
  };
  for (const plot of document.querySelectorAll(".plot")) {
    const point = (event) => {
      const mark = nearest(plot.querySelectorAll(".mark"), event.clientX, event.clientY);
      if (mark) show(mark);
      else hide();
    };
    plot.addEventListener("pointermove", point);
    plot.addEventListener("pointerdown", point);
    plot.addEventListener("pointerleave", hide);
    plot.addEventListener("blur", hide);
    plot.addEventListener("keydown", (event) => {
      const marks = [...plot.querySelectorAll(".mark")];
      const at = marks.indexOf(here);
      const last = marks.length - 1;
      const next = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: last };
      if (event.key === "Escape") hide();
      if (!(event.key in next) || marks.length === 0) return;
      event.preventDefault();
      show(marks[Math.max(0, Math.min(next[event.key], last))]);
    });
  }
  addEventListener("scroll", hide, { passive: true });
}
