"use strict";
document.documentElement.classList.remove("no-script");
const still = { mode: "immediate", frame: { duration: 0, redraw: true }, transition: { duration: 0 } };
for (const chart of document.querySelectorAll(".chart")) {
  const data = JSON.parse(document.getElementById(chart.id + "-data").textContent);
  chart.style.height = data.layout.height + "px"; // which a change of the window's width keeps
  const settings = { displaylogo: false, responsive: true };
  const drawn = Plotly.newPlot(chart, data.data, data.layout, settings)
    .then(() => Plotly.addFrames(chart, data.frames || []))
    .then(() => chart.classList.add("drawn"));
  const slider = document.getElementById(chart.id + "-time");
  if (slider) {
    const moment = document.getElementById(chart.id + "-moment");
    slider.addEventListener("input", () => {
      moment.textContent = data.moments[slider.value];
      slider.setAttribute("aria-valuetext", moment.textContent);
      drawn.then(() => Plotly.animate(chart, [slider.value], still));
    });
  }
}
