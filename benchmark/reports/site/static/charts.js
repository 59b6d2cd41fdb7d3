// Draws each chart from the data beside it, in the page's colours; boxes choose the lines.
(() => {
  "use strict";

  const STEPS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
  const TICKS = [...STEPS.map((one) => -one), 0, ...STEPS]; // of a logarithmic axis

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  const looks = () => ({
    background: "transparent",
    font: getComputedStyle(document.body).fontFamily,
    view: { stroke: null },
    axis: {
      labelColor: colour("--quiet"),
      titleColor: colour("--ink"),
      titleFontWeight: "normal",
      titleFontSize: 13,
      titlePadding: 10,
      labelFontSize: 12,
      gridColor: colour("--line"),
      domainColor: colour("--line"),
      tickColor: colour("--line"),
    },
    rule: { color: colour("--quiet") },
  });

  const start = (figure) => {
    const { spec, points } = JSON.parse(figure.querySelector("script").textContent);
    const boxes = [...figure.querySelectorAll("fieldset.series input:not(.logarithmic)")];
    const logarithmic = figure.querySelector("input.logarithmic");
    const place = figure.querySelector(".canvas");

    const draw = async () => {
      const chosen = new Set(boxes.filter((box) => box.checked).map((box) => box.value));
      const drawn = structuredClone(spec);
      if (logarithmic.checked) {
        for (const layer of drawn.layer) {
          layer.encoding.y.scale = { type: "symlog" };
          layer.encoding.y.axis = { values: TICKS };
        }
      }
      drawn.datasets = { ...drawn.datasets, points: points.filter((one) => chosen.has(one.series)) };
      await vegaEmbed(place, drawn, {
        actions: false,
        ast: true, // expressions are interpreted, so that no page needs to allow eval
        renderer: "svg",
        config: looks(),
        tooltip: { theme: "custom" },
      });
      // the frame has a name and the page a table; the lines themselves are no help to be read
      place.querySelector("svg").setAttribute("aria-hidden", "true");
    };

    figure.querySelector("fieldset.series").disabled = false;
    figure.querySelector("fieldset.series").addEventListener("change", draw);
    document.addEventListener("theme", draw);
    return draw();
  };

  document.querySelectorAll("figure.chart").forEach(start);
})();
