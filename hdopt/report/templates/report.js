"use strict";
(() => {
  const PRINT_WIDTH = 660; // px: fits A4 and Letter within the margins of the print style
  const printHeight = (height) => Math.round(height * (height > 460 ? 0.8 : 0.68)); // tall ones need their rows
  const PRINT_TYPE = 0.8; // size of a table's type in print against that on the screen, a little above the style's
  const LEGEND_LINE = 17; // px
  const NARROW = 520; // px: below it a figure takes smaller type and leaves dragging to the page
  const UPRIGHT = 700; // px: below it labels that slant stand upright
  const json = (id) => JSON.parse(document.getElementById(id).textContent);
  const plots = [...document.querySelectorAll(".plot")];
  const template = plots.length ? json("template") : null;
  const config = {
    displaylogo: false,
    responsive: false,
    // Named one by one: Plotly's own choice has a button that sends the figure's data to a server.
    modeBarButtons: [["toImage", "resetViews"]],
    displayModeBar: !matchMedia("(pointer: coarse)").matches,
  };

  let printing = false;

  // What depends on the width a figure is given; the rest of its layout is its builder's.
  const sizes = (plot, width) => {
    const own = plot.ownLayout;
    const narrow = width < NARROW;
    // On a narrow screen each entry of the legend takes a line of its own, which the plot is not to pay for.
    const legend = narrow ? LEGEND_LINE * Math.max(0, plot.legendEntries - 2) : 0;
    const size = (own.font && own.font.size) || 13;
    // Labels that stand upright take their room from the plot: it gets the height of a narrow screen then.
    const asked = own.narrowHeight && (narrow || (own.tickangle && width < UPRIGHT)) ? own.narrowHeight : plot.ownHeight;
    const height = printing ? printHeight(asked) : asked;
    return {
      width,
      height: height + legend,
      "font.size": narrow ? Math.min(size, 11) : size,
      dragmode: narrow ? false : own.dragmode || "zoom",
      // Slanted labels of many ticks run into each other where there is little room, two lines of one sooner than one.
      ...(own.tickangle ? { "xaxis.tickangle": width < UPRIGHT ? -90 : own.tickangle } : {}),
      ...(own.tickangle && own.ticktext ? { "xaxis.ticktext": narrow ? own.ticktext.map((text) => text.replace("<br>", ", ")) : own.ticktext } : {}),
    };
  };

  const draw = (plot) => {
    const { data, layout } = json("figure-data-" + plot.dataset.figure);
    const { tickangle, ticktext } = layout.xaxis || {};
    const narrowHeight = (layout.meta || {}).narrow_height;
    plot.ownLayout = { font: layout.font, dragmode: layout.dragmode, tickangle, ticktext, narrowHeight };
    plot.ownHeight = layout.height || plot.clientHeight;
    plot.legendEntries = data.filter((trace) => trace.showlegend !== false && trace.name && !(trace.type === "heatmap")).length;
    const size = sizes(plot, plot.clientWidth);
    const font = { ...layout.font, size: size["font.size"] };
    const { width, height, dragmode } = size;
    plot.style.height = height + "px";
    const upright = { tickangle: size["xaxis.tickangle"], ...(size["xaxis.ticktext"] ? { ticktext: size["xaxis.ticktext"] } : {}) };
    const xaxis = tickangle ? { xaxis: { ...layout.xaxis, ...upright } } : {};
    return Plotly.newPlot(plot, data, { ...layout, ...xaxis, template, width, height, font, dragmode }, {
      ...config, toImageButtonOptions: { format: "svg", filename: plot.dataset.figure },
    });
  };

  const fit = (width) => plots.forEach((plot) => {
    const wanted = width || plot.clientWidth;
    if (!plot._fullLayout) return;
    const size = sizes(plot, wanted);
    if (plot._fullLayout.width === size.width && plot._fullLayout.height === size.height) return;
    plot.style.height = size.height + "px";
    Plotly.relayout(plot, size);
  });

  // A file that lies in the page, compressed.
  const file = (name, type = "application/octet-stream") => {
    const holder = [...document.querySelectorAll("script[data-name]")].find((node) => node.dataset.name === name);
    const bytes = Uint8Array.from(atob(holder.textContent), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream, { headers: { "Content-Type": type } }).blob();
  };
  const save = async (name) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await file(name));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  };
  for (const button of document.querySelectorAll("[data-file]")) button.addEventListener("click", () => save(button.dataset.file));
  for (const button of document.querySelectorAll("[data-open]")) {
    button.addEventListener("click", async () => {
      const name = button.dataset.open;
      open(URL.createObjectURL(await file(name, name.endsWith(".svg") ? "image/svg+xml" : "text/html")));
    });
  }

  window.hdoptReport = { drawn: Promise.all(plots.map(draw)).then(() => plots.length), file };
  window.hdoptReport.drawn.catch((error) => console.error(error));

  // Paper does not scroll: a table wider than the page is set smaller.
  const fitTables = () => document.querySelectorAll(".scroll table").forEach((table) => {
    const zoom = Math.min(1, PRINT_WIDTH / (PRINT_TYPE * table.scrollWidth));
    table.style.setProperty("--print-zoom", zoom.toFixed(3));
  });

  let waiting = 0;
  addEventListener("resize", () => {
    clearTimeout(waiting);
    if (!printing) waiting = setTimeout(() => printing || fit(), 100);
  });
  addEventListener("beforeprint", () => { printing = true; fit(PRINT_WIDTH); fitTables(); });
  addEventListener("afterprint", () => { printing = false; fit(); });

  const contents = document.querySelector(".contents details");
  if (contents && matchMedia("(max-width: 62rem)").matches) contents.open = false;
  const links = new Map([...document.querySelectorAll(".contents a")].map((a) => [a.hash.slice(1), a]));
  const inView = new Set();
  const watcher = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) inView[isIntersecting ? "add" : "delete"](target.id);
    let first = true;
    for (const [id, link] of links) {
      const current = first && inView.has(id);
      if (current) first = false;
      current ? link.setAttribute("aria-current", "location") : link.removeAttribute("aria-current");
    }
  }, { rootMargin: "-10% 0px -60% 0px" });
  document.querySelectorAll("main > section").forEach((section) => watcher.observe(section));
})();
