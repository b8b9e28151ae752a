"use strict";
for (const scrubber of document.querySelectorAll(".scrubber")) {
  const slider = scrubber.querySelector("input");
  const clock = scrubber.querySelector("output");
  const drawn = (parent, kind, attributes) => {
    const element = parent.appendChild(document.createElementNS("http://www.w3.org/2000/svg", kind));
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    return element;
  };

  const drawings = scrubber.closest("figure").querySelectorAll(".panel > svg");
  const marks = JSON.parse(scrubber.dataset.tracks).flatMap(({ end, scale, robots }, panel) => {
    const svg = drawings[panel];
    return robots.map(({ color, states, places }) => {
      const group = drawn(svg, "g", { class: "scrubbed", "aria-hidden": "true" });
      drawn(group, "circle", { r: 4.2, fill: color, stroke: "#ffffff", "stroke-width": 1 });
      const ring = drawn(group, "circle", { r: 7.5, fill: "none", stroke: color, "stroke-width": 1.8 });
      const last = states.length - 1;
      return (t) => {
        const at = Math.min(t / end, 1) * last;
        const k = Math.min(Math.floor(at), last - 1);
        const [x, y] = [0, 1].map((axis) => {
          const [from, to] = [places[2 * k + axis], places[2 * k + 2 + axis]];
          return ((from + (at - k) * (to - from)) / scale).toFixed(2);
        });
        group.setAttribute("transform", `translate(${x} ${y})`);
        const state = states[Math.round(at)];
        ring.setAttribute("visibility", state === "0" ? "hidden" : "visible");
        ring.setAttribute("stroke-dasharray", state === "1" ? "2.5 2" : "none");
      };
    });
  });

  const show = () => {
    const t = Number(slider.value);
    for (const move of marks) move(t);
    clock.textContent = `${t.toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", `${t.toFixed(2)} seconds`);
  };
  slider.addEventListener("input", show);
  scrubber.hidden = false;
  show();
}
