// SPDX-License-Identifier: BSD-3-Clause
// Reading values under the pointer, zooming in x by dragging (double click: whole range), hiding curves by the legend.
"use strict";
(() => {
  const root = document.documentElement;
  const wanted = /theme=(light|dark)/.exec(location.hash);
  if (wanted) root.dataset.theme = wanted[1];
  document.getElementById("theme").onclick = () => {
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  };

  for (const key of document.querySelectorAll(".key")) {
    key.onclick = () => {
      const off = key.classList.toggle("off");
      for (const curve of key.closest("figure").querySelectorAll("[data-name]"))
        if (` ${curve.dataset.name} `.includes(` ${key.dataset.key} `))
          curve.classList.toggle("hidden", off);
    };
  }

  const tip = document.createElement("div");
  tip.id = "tip";
  tip.hidden = true;
  document.body.append(tip);

  const make = (parent, name, attributes) => {
    const node = document.createElementNS(parent.namespaceURI, name);
    for (const [k, v] of Object.entries(attributes)) node.setAttribute(k, v);
    parent.append(node);
    return node;
  };
  const points = (curve) => {
    if (curve.points) return curve.points;
    const xs = [], ys = [];
    for (const part of curve.getAttribute("d").split("M").slice(1)) {
      const n = part.match(/-?\d+/g).map(Number);
      let x = n[0], y = n[1];
      xs.push(x); ys.push(y);
      for (let i = 2; i + 1 < n.length; i += 2) { x += n[i]; y += n[i + 1]; xs.push(x); ys.push(y); }
    }
    return (curve.points = [xs, ys]);
  };
  const nearest = (xs, x) => {
    let a = 0, b = xs.length - 1;
    while (b - a > 1) { const m = (a + b) >> 1; if (xs[m] < x) a = m; else b = m; }
    return x - xs[a] < xs[b] - x ? a : b;
  };
  const text = (v) => (v === 0 ? "0" : Math.abs(v) >= 1e-3 && Math.abs(v) < 1e5 ? String(+v.toPrecision(4)) : v.toExponential(2));
  const value = (range, log, share) =>
    log ? 10 ** (Math.log10(range[0]) + share * Math.log10(range[1] / range[0])) : range[0] + share * (range[1] - range[0]);

  const plots = [];
  for (const svg of document.querySelectorAll("svg.plot[data-x]")) {
    const data = svg.querySelector("svg.data"), frame = svg.querySelector("rect.frame");
    const [logX, logY] = svg.dataset.log.split(",").map(Number);
    const p = {
      svg, data, frame, logX, logY,
      x: svg.dataset.x.split(",").map(Number), y: svg.dataset.y.split(",").map(Number),
      W: +data.getAttribute("width"), H: +data.getAttribute("height"), shown: [0, 1],
      figure: svg.closest("figure"), group: svg.closest("figure").dataset.group,
    };
    frame.style.pointerEvents = "all";
    p.cursor = make(frame.parentNode, "path", { class: "cursor", d: "" });
    p.select = make(frame.parentNode, "rect", { class: "select", height: p.H, width: 0 });
    plots.push(p);
  }
  const friends = (p) => plots.filter((o) => o === p || (p.group && o.group === p.group) || (!p.group && o.figure === p.figure));
  const share = (p, event) => {
    const box = p.frame.getBoundingClientRect();
    return Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
  };

  const zoom = (p, from, to) => {
    p.shown = [from, to];
    p.data.setAttribute("viewBox", `${from * p.W * 10} 0 ${(to - from) * p.W * 10} ${p.H * 10}`);
    const ticks = p.svg.querySelector(".xticks"), labelled = p.labelled ?? (p.labelled = !!ticks.querySelector("text"));
    const low = value(p.x, 0, from), high = value(p.x, 0, to);
    const raw = (high - low) / Math.max(p.W / 90, 2), power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
    ticks.replaceChildren();
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
      const at = ((k * step - low) / (high - low)) * p.W;
      make(ticks, "path", { class: "grid", d: `M${at} 0V${p.H}` });
      if (labelled) make(ticks, "text", { class: "x", x: at, y: p.H + 14 }).textContent = String(+(k * step).toPrecision(8)).replace("-", "−");
    }
  };

  const read = (p, event) => {
    const s = share(p, event), at = p.shown[0] + s * (p.shown[1] - p.shown[0]), unit = at * p.W * 10;
    const box = p.frame.getBoundingClientRect(), rows = [];
    for (const curve of p.data.querySelectorAll("path[data-name]:not(.bars):not(.hidden)")) {
      const [xs, ys] = points(curve);
      if (!xs.length) continue;
      const i = nearest(xs, unit);
      if (Math.abs(xs[i] - unit) > 300) continue;
      const row = document.createElement("div"), dot = document.createElement("i");
      dot.textContent = "● ";
      dot.className = [...curve.classList].find((c) => /^([km]\d|ink|soft)$/.test(c)) || "";
      row.append(dot, `${curve.dataset.name}: ${text(value(p.y, p.logY, 1 - ys[i] / (p.H * 10)))}`);
      rows.push(row);
    }
    const head = document.createElement("b");
    head.textContent = text(value(p.x, p.logX, at));
    tip.replaceChildren(head, ...rows);
    tip.hidden = false;
    tip.style.left = Math.min(event.clientX + 16, innerWidth - tip.offsetWidth - 8) + "px";
    tip.style.top = Math.min(event.clientY + 16, innerHeight - tip.offsetHeight - 8) + "px";
    for (const f of friends(p)) f.cursor.setAttribute("d", `M${s * f.W} 0V${f.H}`);
    return box;
  };

  for (const p of plots) {
    let start = null;
    p.frame.onpointermove = (event) => {
      read(p, event);
      if (start === null) return;
      const [a, b] = [start, share(p, event)].sort((u, v) => u - v);
      for (const f of friends(p)) { f.select.setAttribute("x", a * f.W); f.select.setAttribute("width", (b - a) * f.W); }
    };
    p.frame.onpointerleave = () => { tip.hidden = true; for (const f of friends(p)) f.cursor.setAttribute("d", ""); };
    p.frame.onpointerdown = (event) => {
      if (event.pointerType !== "mouse" || p.logX) return;
      start = share(p, event);
      p.frame.setPointerCapture(event.pointerId);
    };
    p.frame.onpointerup = (event) => {
      if (start === null) return;
      const [a, b] = [start, share(p, event)].sort((u, v) => u - v), [u, v] = p.shown;
      start = null;
      for (const f of friends(p)) f.select.setAttribute("width", 0);
      if (b - a > 0.01) for (const f of friends(p)) zoom(f, u + a * (v - u), u + b * (v - u));
    };
    p.frame.ondblclick = () => { if (!p.logX) for (const f of friends(p)) zoom(f, 0, 1); };
  }

  for (const cell of document.querySelectorAll(".cell[data-tip]")) {
    cell.onpointermove = (event) => {
      tip.textContent = cell.dataset.tip;
      tip.hidden = false;
      tip.style.left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8) + "px";
      tip.style.top = event.clientY + 16 + "px";
    };
    cell.onpointerleave = () => (tip.hidden = true);
  }

  const links = [...document.querySelectorAll("nav a")];
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries)
      if (entry.isIntersecting) for (const a of links) a.classList.toggle("here", a.hash === "#" + entry.target.id);
  }, { rootMargin: "-20% 0px -70% 0px" });
  for (const section of document.querySelectorAll("section")) seen.observe(section);
})();
