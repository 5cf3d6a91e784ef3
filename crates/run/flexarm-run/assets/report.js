"use strict";
// Draws the plots of a flexarm report from the JSON in the page. Plots over time share cursor and zoom.
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const root = document.getElementById("plots");
  const PRINT_WIDTH = 680;
  let drawn = [];
  let printing = false;
  let bare = false;

  const make = (tag, name, text) => {
    const node = document.createElement(tag);
    if (name) node.className = name;
    if (text !== undefined) node.textContent = text;
    return node;
  };
  // The style of the page decides the colours, on paper always those of light paper.
  const LIGHT = { ink: "#1c2128", faint: "#4d5663", grid: "#e3e6eb", band: "rgba(0,96,168,0.07)", rule: "#aab2bd" };
  const colors = () => {
    const style = getComputedStyle(document.documentElement);
    const get = (name) => style.getPropertyValue("--" + name).trim();
    const of = (before) => {
      const c = [];
      for (let k = 0; get(before + "c" + k); k++) c.push(get(before + "c" + k));
      return { c, x: get(before + "x"), y: get(before + "y"), z: get(before + "z"), rigid: get(before + "rigid") };
    };
    if (printing) return { ...LIGHT, ...of("paper-") };
    return { ink: get("ink"), faint: get("faint"), grid: get("grid"), band: get("band"), rule: get("faint"), ...of("") };
  };

  // Numbers with as many digits as tell them apart.
  const shown = (v) => {
    if (v === null || v === undefined) return "–";
    if (v === 0) return "0";
    const a = Math.abs(v);
    if (a >= 1e5 || a < 1e-4) return v.toExponential(3);
    return v.toFixed(Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(a)))));
  };
  const ticks = (u, splits) => {
    const found = splits.filter((v) => v !== null);
    const step = found.length > 1 ? Math.abs(found[1] - found[0]) : 1;
    let digits = 0;
    while (digits < 9 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6 * step * 10 ** digits) digits++;
    const large = Math.max(...found.map(Math.abs));
    return splits.map((v) => v === null ? "" : large >= 1e5 ? Number(v.toPrecision(6)).toExponential() : v.toFixed(digits));
  };
  const decades = (u, splits) => splits.map((v) => {
    if (v === null) return "";
    const power = Math.log10(v);
    if (Math.abs(power - Math.round(power)) > 1e-6) return "";
    return v >= 1e-3 && v < 1e4 ? String(Number(v.toPrecision(1))) : "1e" + Math.round(power);
  });

  const whole = (u, splits) => splits.map((v) => v !== null && Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-6 ? v : null);

  // What a time belongs to: grey bands are moves, lines are single events.
  const bandsOf = (events) => {
    const bands = [];
    let start = null;
    for (const event of events) {
      if (event.kind === "move start") start = event.t;
      if (event.kind === "move end" && start !== null) { bands.push([start, event.t]); start = null; }
    }
    if (start !== null) bands.push([start, Infinity]);
    return bands;
  };
  const LOOKS = { "peak": ["▼", 1], "settled": ["✓", 2], "limit": ["!", 3], "load": ["◆", 4], "stopped": ["✕", 1] };

  function decorations(plot, events, look) {
    const bands = plot.time ? bandsOf(events) : [];
    const lines = plot.time
      ? events.filter((e) => LOOKS[e.kind]).map((e) => ({ x: e.t, sign: LOOKS[e.kind][0], color: look.c[LOOKS[e.kind][1]] }))
      : plot.marks.map((m, k) => ({ x: m.x, sign: "f" + (k + 1), color: look.faint }));
    const told = plot.time ? events.map((e) => ({ x: e.t, text: e.text })) : plot.marks;
    let tip = null;
    return {
      hooks: {
        init: [(u) => { tip = make("div", "tip"); u.over.appendChild(tip); }],
        drawClear: [(u) => {
          const { ctx, bbox } = u;
          ctx.save();
          ctx.fillStyle = look.band;
          for (const [from, to] of bands) {
            const a = Math.max(u.valToPos(from, "x", true), bbox.left);
            const b = Math.min(to === Infinity ? Infinity : u.valToPos(to, "x", true), bbox.left + bbox.width);
            if (b > a) ctx.fillRect(a, bbox.top, b - a, bbox.height);
          }
          ctx.restore();
        }],
        draw: [(u) => {
          if (bare) return;
          const { ctx, bbox } = u;
          const ratio = uPlot.pxRatio;
          ctx.save();
          ctx.font = `${11 * ratio}px system-ui, sans-serif`;
          ctx.textAlign = "center";
          ctx.textBaseline = "top";
          let last = -Infinity;
          for (const line of lines) {
            const x = Math.round(u.valToPos(line.x, "x", true));
            if (x < bbox.left - 1 || x > bbox.left + bbox.width + 1) continue;
            ctx.strokeStyle = line.color;
            ctx.fillStyle = line.color;
            ctx.lineWidth = ratio;
            ctx.globalAlpha = 0.75;
            ctx.setLineDash([4 * ratio, 3 * ratio]);
            ctx.beginPath();
            ctx.moveTo(x, bbox.top + 13 * ratio);
            ctx.lineTo(x, bbox.top + bbox.height);
            ctx.stroke();
            ctx.globalAlpha = 1;
            // Signs that would lie on each other are left out; the tip names all.
            if (x - last > 13 * ratio) {
              ctx.fillText(line.sign, x, bbox.top + ratio);
              last = x;
            }
          }
          ctx.restore();
        }],
        setCursor: [(u) => {
          const left = u.cursor.left;
          // Other plots share the cursor; one tip is enough.
          const near = left < 0 || !u.over.matches(":hover") ? [] : told.filter((e) => Math.abs(u.valToPos(e.x, "x") - left) < 6);
          tip.style.display = near.length ? "block" : "none";
          if (!near.length) return;
          tip.textContent = near.map((e) => plot.time ? `${shown(e.x)} s: ${e.text}` : e.text).join("\n");
          const right = left > u.over.clientWidth / 2;
          tip.style.left = right ? "auto" : left + 10 + "px";
          tip.style.right = right ? u.over.clientWidth - left + 10 + "px" : "auto";
        }],
        setScale: [(u, key) => {
          if (key !== "x" || !plot.time) return;
          const { min, max } = u.scales.x;
          const whole = (x) => ({ min: x[0], max: x[x.length - 1] });
          const own = whole(u.data[0]);
          for (const other of drawn) {
            if (!other.chart || other.chart === u || !other.plot.time) continue;
            // Runs differ in length: who shows everything of one shows everything of all.
            const wanted = min === own.min && max === own.max ? whole(other.chart.data[0]) : { min, max };
            const scale = other.chart.scales.x;
            if (scale.min === wanted.min && scale.max === wanted.max) continue;
            other.chart.setScale("x", wanted);
          }
        }],
      },
    };
  }

  // All runs of a view on one axis.
  function tableOf(view) {
    if (view.tables.length === 1) return [view.tables[0].x, ...view.tables[0].curves.map((c) => c.y)];
    // Places that repeat (a stop, on a path) stay in order by being told apart by a hair.
    const apart = view.tables.map((t) => {
      const x = t.x.slice();
      for (let k = 1; k < x.length; k++) if (x[k] <= x[k - 1]) x[k] = x[k - 1] + 1e-9 * (Math.abs(x[k - 1]) + 1);
      return [x, ...t.curves.map((c) => c.y)];
    });
    return uPlot.join(apart);
  }

  function draw(entry) {
    const { plot, box, events } = entry;
    const view = plot.views[entry.view];
    const look = colors();
    const unit = view.unit || plot.yUnit;
    const curves = view.tables.flatMap((t) => t.curves);
    const several = view.tables.length > 1;
    // Runs that agree lie on each other: width and dashes let the ones below be seen.
    const layers = [[2.6], [1.5, [9, 6]], [1.5, [3, 4]], [1.5, [12, 4, 3, 4]]];
    let next = 0;
    const series = curves.map((curve, k) => {
      const total = curve.kind === "total";
      const layer = several ? layers[Math.min(k, layers.length - 1)] : null;
      // Axes, the rigid twin, and links, springs and joints have colours of their own; all else is counted.
      const own = { total: look.ink, dashed: look.rigid, x: look.x, y: look.y, z: look.z }[curve.kind];
      const color = own || look.c[(curve.color ?? next++) % look.c.length];
      return {
        label: curve.name, stroke: color, width: layer ? layer[0] : total ? 1.8 : 1.4, spanGaps: several, points: { show: false },
        dash: layer ? layer[1] : curve.kind === "dashed" ? [6, 4] : undefined, value: (u, v) => shown(v),
      };
    });
    const axis = {
      stroke: look.faint, grid: { stroke: look.grid, width: 1 }, ticks: { stroke: look.grid, width: 1, size: 5 },
      font: "12px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif",
    };
    const width = printing ? PRINT_WIDTH : Math.max(240, box.clientWidth);
    const old = entry.chart && !entry.fresh ? { min: entry.chart.scales.x.min, max: entry.chart.scales.x.max } : null;
    if (entry.chart) entry.chart.destroy();
    const table = tableOf(view);
    const options = {
      width, height: printing ? 200 : plot.wide ? 320 : 260,
      scales: {
        x: { time: false },
        y: plot.log ? { distr: 3 } : { range: (u, low, high) => {
          if (low === null || high === null) return [0, 1];
          const room = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
          // Room above for the signs of events.
          return [low >= 0 && low < 0.3 * high ? 0 : low - room, high + 1.6 * room];
        } },
      },
      axes: [
        { ...axis, label: `${plot.xLabel} (${plot.xUnit})`, labelSize: 20, size: 34, values: ticks },
        { ...axis, label: `${plot.yLabel} (${unit})`, labelSize: 18, size: 58, ...(plot.log ? { values: decades, grid: { ...axis.grid, filter: whole } } : { values: ticks }) },
      ],
      series: [{ label: plot.xLabel, value: (u, v) => v === null || v === undefined ? "–" : `${shown(v)} ${plot.xUnit}` }, ...series],
      cursor: { drag: { x: true, y: false }, points: { size: 6 }, sync: plot.time ? { key: "time", setSeries: false } : undefined },
      legend: { markers: { width: 0, fill: (u, k) => u.series[k].stroke ? u.series[k].stroke(u, k) : null } },
      plugins: [decorations(plot, events, look)],
    };
    entry.chart = new uPlot(options, table, box);
    entry.fresh = false;
    // A drawing made anew (another view, colour or width) keeps the zoom.
    const full = table[0];
    if (old && old.min !== null && (old.min > full[0] || old.max < full[full.length - 1])) entry.chart.setScale("x", old);
  }

  function place(plots, events, title, parent) {
    if (title) {
      const bar = make("div", "bar");
      bar.appendChild(make("h2", "", title));
      parent.appendChild(bar);
    }
    const grid = make("div", "grid");
    parent.appendChild(grid);
    for (const plot of plots) {
      const card = make("div", plot.wide ? "plot wide" : "plot");
      card.id = "plot-" + plot.id;
      const head = make("div", "head");
      head.appendChild(make("h3", "", plot.title));
      const entry = { plot, events, view: 0, chart: null };
      if (plot.views.length > 1) {
        const select = make("select");
        select.setAttribute("aria-label", "curves of " + plot.title);
        plot.views.forEach((view, k) => {
          const option = make("option", "", view.name);
          option.value = String(k);
          select.appendChild(option);
        });
        select.addEventListener("change", () => { entry.view = Number(select.value); draw(entry); });
        head.appendChild(select);
      }
      card.appendChild(head);
      if (plot.note) card.appendChild(make("p", "note", plot.note));
      entry.box = make("div", "canvas");
      card.appendChild(entry.box);
      grid.appendChild(card);
      drawn.push(entry);
    }
  }

  function build(which) {
    for (const entry of drawn) if (entry.chart) entry.chart.destroy();
    drawn = [];
    root.replaceChildren();
    if (data.overlays.length) place(data.overlays, data.runs[0].events, "All runs", root);
    const run = data.runs[which];
    const bar = make("div", "bar");
    if (data.runs.length > 1) {
      bar.appendChild(make("h2", "", "Details of"));
      const select = make("select");
      select.setAttribute("aria-label", "run");
      data.runs.forEach((r, k) => {
        const option = make("option", "", r.label);
        option.value = String(k);
        option.selected = k === which;
        select.appendChild(option);
      });
      select.addEventListener("change", () => build(Number(select.value)));
      bar.appendChild(select);
    }
    const hint = make("span", "hint");
    hint.appendChild(make("i"));
    hint.appendChild(document.createTextNode("moves  ·  ▼ peak  ✓ settled  ! limit  ◆ load  ·  drag to zoom, double click to reset, click a name to hide its curve"));
    bar.appendChild(hint);
    root.appendChild(bar);
    const sections = [...new Set(run.plots.map((p) => p.section))];
    for (const section of sections) place(run.plots.filter((p) => p.section === section), run.events, section, root);
    for (const entry of drawn) draw(entry);
  }

  const redraw = () => { for (const entry of drawn) draw(entry); };
  let waiting = 0;
  let width = window.innerWidth;
  window.addEventListener("resize", () => {
    if (printing || width === window.innerWidth) return;
    width = window.innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(redraw, 120);
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { if (!printing) redraw(); });
  window.addEventListener("beforeprint", () => { printing = true; redraw(); });
  window.addEventListener("afterprint", () => { printing = false; redraw(); });
  build(0);
  // For checks of this page: the plots, and whether they are drawn without marks.
  window.flexarmBare = (on) => { bare = on; for (const entry of drawn) entry.chart.redraw(false); };
  window.flexarmPlots = () => drawn.map((entry) => ({ id: entry.plot.id, time: entry.plot.time, chart: entry.chart }));
})();
