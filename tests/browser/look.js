// What the harness asks of a page; installed as `look` in every page that is opened.
globalThis.look = (() => {
  const plots = () => [...document.querySelectorAll(".js-plotly-plot")];
  const MARKS = [
    ".cartesianlayer .mlayer path", ".cartesianlayer .mlayer image", ".cartesianlayer .mlayer text",
    ".polarlayer .mlayer path", ".pielayer path", ".sankey path", "canvas",
  ].join(", ");
  const pointsOf = (plot, trace) => (plot.calcdata || []).find((all) => all[0] && all[0].trace === trace) || [];
  const visible = (plot) => (plot._fullData || []).filter((trace) => trace.visible === true);

  // Plotly hides a trace that has no data at all; of one whose data are all missing it keeps a single entry without x.
  const isEmpty = (plot, trace) => {
    const points = pointsOf(plot, trace);
    if (trace.visible === false) return (plot.data[trace.index].visible ?? true) === true;
    return trace.visible === true && (points.length === 0 || (points.length === 1 && points[0].x === false && !points[0].z));
  };

  // Every figure: its traces, those that hold no point, and how many marks of some size are really there.
  const figures = () => plots().map((plot) => {
    const hasSize = (node) => { const box = node.getBoundingClientRect(); return box.width + box.height > 0; };
    const box = plot.getBoundingClientRect();
    return {
      key: plot.dataset.figure || plot.id,
      traces: (plot._fullData || []).length,
      empty: (plot._fullData || []).filter((trace) => isEmpty(plot, trace)).map((trace) => trace.name || trace.type),
      marks: [...plot.querySelectorAll(MARKS)].filter(hasSize).length,
      width: Math.round(box.width),
      drawn_width: plot._fullLayout ? Math.round(plot._fullLayout.width) : 0,
    };
  });

  // Points of the window that a mouse can try over figure i: some of its data, then a grid over its area.
  const probes = (i) => {
    const plot = plots()[i];
    plot.scrollIntoView({ block: "center", behavior: "instant" });
    const box = plot.getBoundingClientRect();
    const tries = [];
    for (const trace of visible(plot).filter((t) => t.hoverinfo !== "skip").slice(0, 4)) {
      const xa = plot._fullLayout[(trace.xaxis || "x").replace("x", "xaxis")];
      const ya = plot._fullLayout[(trace.yaxis || "y").replace("y", "yaxis")];
      const points = pointsOf(plot, trace);
      for (const share of xa && ya ? [0.5, 0.31, 0.73] : []) {
        const { x, y } = points[Math.floor(share * points.length)] || {};
        if (typeof x === "number" && typeof y === "number") tries.push([xa._offset + xa.c2p(x), ya._offset + ya.c2p(y)]);
      }
    }
    for (const y of [0.5, 0.35, 0.65, 0.8])
      for (const x of [0.5, 0.3, 0.7, 0.4, 0.6, 0.2, 0.8]) tries.push([x * box.width, y * box.height]);
    return tries.map(([x, y]) => [box.left + x, box.top + y]);
  };

  const label = (i) => plots()[i].querySelector(".hoverlayer")?.textContent.trim() || "";

  // What reaches beyond the right edge of the window, other than inside a box that scrolls.
  const overflow = () => [...document.querySelectorAll("body *")].filter((node) => {
    const wanted = !node.closest("svg, .scroll > *, script, style") && getComputedStyle(node).position !== "absolute";
    return wanted && node.getBoundingClientRect().right > document.documentElement.clientWidth + 1;
  }).map((node) => {
    const name = [node.tagName.toLowerCase(), ...node.classList].join(".");
    return `${name} reaches ${Math.round(node.getBoundingClientRect().right)} px`;
  });

  // Tables of a size that is read one cell under the other, but that go on beyond the screen.
  const sideways = () => [...document.querySelectorAll(".scroll")].filter((box) => {
    const cells = box.querySelectorAll("tbody > tr > *").length;
    return cells <= 240 && box.scrollWidth > box.clientWidth + 1;
  }).map((box) => `${box.parentElement.id} goes on for ${box.scrollWidth - box.clientWidth} px beyond the screen`);

  return { figures, probes, label, overflow, sideways };
})();
