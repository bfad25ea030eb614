"use strict";
// Everything can be read without this script; it adds a theme button, numbers under the pointer, larger frames.

// Theme: the system's choice until the reader makes another.
{
  const root = document.documentElement;
  const button = document.getElementById("theme");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : dark.matches);
  const show = () => {
    button.textContent = isDark() ? "Light" : "Dark";
    button.setAttribute("aria-pressed", String(isDark()));
    button.setAttribute("aria-label", isDark() ? "Switch to light colours" : "Switch to dark colours");
  };
  button.hidden = false;
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    show();
  });
  dark.addEventListener("change", show);
  show();
}

// Numbers: under the pointer, under a finger, and with the arrow keys once a figure has the focus.
{
  const tip = document.getElementById("tip");
  let here = null;
  const hide = () => {
    here?.classList.remove("here");
    here = null;
    tip.hidden = true;
  };
  const show = (mark) => {
    if (mark === here) return;
    hide();
    here = mark;
    mark.classList.add("here");
    tip.textContent = mark.dataset.tip;
    tip.hidden = false;
    const box = mark.getBoundingClientRect();
    const own = tip.getBoundingClientRect();
    const left = box.left + box.width / 2 - own.width / 2;
    const above = box.top - own.height - 8;
    tip.style.left = `${Math.max(6, Math.min(left, innerWidth - own.width - 6))}px`;
    tip.style.top = `${above > 6 ? above : box.bottom + 8}px`;
  };
  // The nearest mark within reach, so that a finger need not hit a point of three pixels.
  const nearest = (plot, x, y) => {
    let best = null;
    let reach = 24;
    for (const mark of plot.querySelectorAll(".mark")) {
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
  };
  for (const plot of document.querySelectorAll(".plot")) {
    const point = (event) => {
      const mark = nearest(plot, event.clientX, event.clientY);
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
      const next = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: marks.length - 1 };
      if (event.key === "Escape") hide();
      if (!(event.key in next) || marks.length === 0) return;
      event.preventDefault();
      show(marks[Math.max(0, Math.min(next[event.key], marks.length - 1))]);
    });
  }
  addEventListener("scroll", hide, { passive: true });
}

// Commands to the clipboard, where there is one.
for (const button of document.querySelectorAll(".copy")) {
  if (!navigator.clipboard) break;
  button.hidden = false;
  button.addEventListener("click", async () => {
    await navigator.clipboard.writeText(button.dataset.copy);
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = "Copy"), 1500);
  });
}

// Frames, large; the arrow keys leaf through them.
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
    dialog.addEventListener("keydown", (event) => {
      if (event.key === "ArrowLeft") show(at - 1);
      if (event.key === "ArrowRight") show(at + 1);
    });
    document.body.append(dialog);
    for (const [index, figure] of figures.entries()) {
      figure.querySelector(".zoom").addEventListener("click", () => {
        show(index);
        dialog.showModal();
      });
    }
  }
}
