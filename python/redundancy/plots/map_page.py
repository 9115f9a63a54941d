"""A redundancy map as a page to look at in a browser: point at a cell to read it, choose a branch."""

import base64
import html
import json
import re
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._util import F64
from ..files import write_atomically
from .colours import BLACK, LINE_COLORS, WHITE
from .map_data import BY_BADNESS, CAUSE_COLORS, CAUSES, MapData, MapLine, edges_of, is_log, log_ticks, round_ticks
from .map_data import prepared as prepared_map

# Bits of a float32 that are dropped: 13 bits of mantissa stay, of which four digits can be read.
_DROPPED: Final = 10

_PAGE: Final = r"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>@TITLE@</title>
<style>
html, body { height: 100%; margin: 0; }
body { display: flex; flex-direction: column; font: 15px system-ui, sans-serif; color: #000; background: #fff; }
header { display: flex; flex-wrap: wrap; align-items: center; gap: 0.4em 1.5em; padding: 0.6em 1em 0; }
h1 { font-size: 1.15em; margin: 0; }
select { font: inherit; }
#plot { flex: 1; min-height: 300px; }
#message { position: absolute; top: 4em; padding: 1em; margin: 0; }
</style>
</head>
<body>
<header>
<h1>@TITLE@</h1>
<label>show <select id="view"></select></label>
<label id="lines" hidden><input type="checkbox" id="drawn" checked> lines along the path</label>
</header>
<div id="plot"></div>
<p id="message">The map is being unpacked. It needs JavaScript and a browser of 2023 or later.</p>
<script type="application/json" id="figure">@FIGURE@</script>
<script type="application/json" id="map">@MAP@</script>
<script>@PLOTLY@</script>
<script>
"use strict";
const read = (id) => JSON.parse(document.getElementById(id).textContent);

async function unpacked(text) {
  const packed = atob(text), bytes = new Uint8Array(packed.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = packed.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return await new Response(stream).arrayBuffer();
}

// Undo the differences along the path; shape (B, A, N), one after the other.
function decoded(buffer, length, dropped) {
  const planes = new Uint8Array(buffer), size = planes.length / 3, bits = new Uint32Array(size);
  let code = 0;
  for (let i = 0; i < size; i++) {
    if (i % length === 0) code = 0;
    code = (code + (planes[i] | planes[size + i] << 8 | planes[2 * size + i] << 16)) & 0xffffff;
    bits[i] = code << dropped;
  }
  return new Float32Array(bits.buffer);
}

async function start() {
  const figure = read("figure"), map = read("map");
  const [N, A, B] = map.shape;
  const value = decoded(await unpacked(map.value), N, map.dropped);
  const cause = new Uint8Array(await unpacked(map.cause)), pick = new Uint16Array(await unpacked(map.pick));
  // The turn goes on at its ends.
  const rows = [A - 1, ...Array(A).keys(), 0];
  const degrees = rows.map((a, r) => map.degrees[a] + (r === 0 ? -360 : r === A + 1 ? 360 : 0));
  const traces = Object.fromEntries(figure.data.filter((t) => t.meta).map((t) => [t.meta, t]));

  function fill(view) {
    const best = view < 0;
    // One text for all cells of a point, a branch and a cause.
    const texts = Array.from({ length: N }, () => []);
    const text = (n, b, c) => texts[n][b * map.causes.length + c] ??= `point ${n}, ` + (
      c === 0 ? `branch ${b}` : best && B > 1 ? `no branch<br>nearest to feasible: branch ${b}, ${map.causes[c]}`
      : `branch ${b}<br>${map.causes[c]}`);
    const z = [], numbers = [], labels = [], causes = [];
    for (const a of rows) {
      const zRow = new Array(N), numberRow = new Array(N), labelRow = new Array(N), causeRow = new Array(N);
      for (let n = 0; n < N; n++) {
        const b = best ? pick[a * N + n] : view, at = (b * A + a) * N + n, c = cause[at], v = value[at];
        zRow[n] = c ? null : map.log ? Math.log10(v) : v;
        numberRow[n] = c ? null : v;
        labelRow[n] = text(n, b, c);
        causeRow[n] = c || null;
      }
      z.push(zRow); numbers.push(numberRow); labels.push(labelRow); causes.push(causeRow);
    }
    Object.assign(figure.data[0], { x: map.x, y: degrees, z, customdata: numbers, text: labels });
    Object.assign(figure.data[1], { x: map.x, y: degrees, z: causes, text: labels });
    Object.assign(traces.borders, best ? borders() : { x: [], y: [] }, { visible: best });
    const drawn = document.getElementById("drawn").checked;
    map.lines.forEach((line, i) => {
      const on = line.y.map((y, k) => best || line.branch[k] === view ? y : null);
      const mode = N === 1 ? "markers" : "lines";
      for (const under of ["shade", "off"])
        Object.assign(traces[`${under} ${i}`], { x: line.x, y: best ? [] : line.y, visible: drawn, mode });
      Object.assign(traces[`border ${i}`], { x: line.x, y: on, visible: drawn, mode, marker: { size: 11 } });
      Object.assign(traces[`on ${i}`], { x: line.x, y: on, visible: drawn, mode, marker: { size: 8 } });
      Object.assign(traces[`dots ${i}`], { visible: drawn,
        x: line.changes.map((k) => line.x[k]), y: line.changes.map((k) => line.y[k]) });
    });
  }

  // Borders between feasible cells of different branches, each run of them one stroke.
  function borders() {
    const x = [], y = [];
    const between = (values, i) => i < 0 ? values[0] : i + 1 >= values.length ? values[values.length - 1]
      : 0.5 * (values[i] + values[i + 1]);
    const branch = (r, n) => {
      const a = rows[r], b = pick[a * N + n];
      return cause[(b * A + a) * N + n] ? -1 : b;
    };
    const grid = rows.map((_, r) => Int32Array.from({ length: N }, (_, n) => branch(r, n)));
    const differ = (a, b) => a >= 0 && b >= 0 && a !== b;
    const runs = (count, marked, stroke) => {
      for (let i = 0, from = -1; i <= count; i++) {
        const set = i < count && marked(i);
        if (set && from < 0) from = i;
        if (!set && from >= 0) { stroke(from, i); from = -1; }
      }
    };
    const across = (n) => N === 1 ? map.x[0] + n + 0.5 : n < 0 ? 1.5 * map.x[0] - 0.5 * map.x[1]
      : n + 1 >= N ? 1.5 * map.x[N - 1] - 0.5 * map.x[N - 2] : between(map.x, n);
    const up = (r) => Math.max(-180, Math.min(180, between(degrees, r)));
    for (let n = 0; n + 1 < N; n++) {
      runs(A + 2, (r) => differ(grid[r][n], grid[r][n + 1]), (from, to) => {
        x.push(across(n), across(n), null); y.push(up(from - 1), up(to - 1), null);
      });
    }
    for (let r = 0; r <= A; r++) {
      if (Math.abs(0.5 * (degrees[r] + degrees[r + 1])) >= 180) continue;
      runs(N, (n) => differ(grid[r][n], grid[r + 1][n]), (from, to) => {
        x.push(across(from - 1), across(to - 1), null); y.push(up(r), up(r), null);
      });
    }
    return { x, y };
  }

  const view = document.getElementById("view"), plot = document.getElementById("plot");
  view.add(new Option("the best branch", -1));
  for (const b of map.branches) view.add(new Option(`branch ${b}`, b));
  document.getElementById("lines").hidden = map.lines.length === 0;
  const config = { responsive: true, displaylogo: false, scrollZoom: true };
  const draw = () => { fill(Number(view.value)); return Plotly.react(plot, figure.data, figure.layout, config); };
  view.addEventListener("change", draw);
  document.getElementById("drawn").addEventListener("change", draw);
  await draw();
  document.getElementById("message").remove();
}
start().catch((error) => { document.getElementById("message").textContent = `The map cannot be shown: ${error}`; });
</script>
</body>
</html>
"""


def write_map_html(
    file: str | Path,
    value: ArrayLike,
    cause: ArrayLike,
    angles: ArrayLike,
    distance: ArrayLike | None = None,
    *,
    lines: Sequence[MapLine] = (),
    name: str = "condition number κ<sub>F</sub>",
    title: str = "redundancy map",
    distance_label: str | None = None,
    angle_name: str = "spin",
) -> None:
    """Write a redundancy map as a page that needs no network: one file, any browser of 2023 or later.

    Parameters
    ----------
    file : path-like
        Its folder has to exist.
    value, cause, angles, distance, lines, distance_label, angle_name
        As for `redundancy.plots.redundancy_map_figure`.
    name : str
        What the value is; may contain ``<sub>``, ``<sup>``, ``<i>`` and ``<b>``.
    title : str
        Title of the page.

    Raises
    ------
    ImportError
        If plotly is not installed.
    ShapeError
        If the arrays do not fit together.
    InvalidValueError
        If a cause or a branch is unknown, an angle comes twice, or the path goes back.
    NonFiniteError
        If an angle or a distance is not finite.
    OSError
        If the file cannot be written.
    """
    try:
        from plotly import graph_objects
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise ImportError("the interactive map needs plotly: pip install redundancy[html]") from error
    data = prepared_map(value, cause, angles, distance, lines, distance_label, angle_name)
    # By way of plotly's own classes, which refuse what plotly.js would ignore.
    figure = graph_objects.Figure(_traces(data, name), _layout(data)).to_plotly_json()
    parts = {
        "TITLE": html.escape(title),
        "FIGURE": _as_json({"data": list(figure["data"]), "layout": figure["layout"]}),
        "MAP": _as_json(content(data)),
        "PLOTLY": get_plotlyjs(),
    }
    write_atomically(file, re.sub("@([A-Z]+)@", lambda mark: parts[mark[1]], _PAGE))


def _as_json(content: object) -> str:
    """Return JSON that ends no script element."""
    return json.dumps(content, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def content(data: MapData) -> dict[str, Any]:
    """Return what the page computes its pictures from: every number of the map once.

    Parameters
    ----------
    data : MapData
        The map.

    Returns
    -------
    dict
        What JSON can hold.
    """
    feasible = (data.cause == 0).any(axis=(0, 1))
    return {
        "shape": list(data.value.shape),
        "x": _rounded(data.x),
        "degrees": [round(float(angle), 4) for angle in data.degrees],
        "causes": CAUSES,
        "branches": [int(branch) for branch in np.flatnonzero(feasible)],
        "log": is_log(data.limits() or (0.0, 0.0)),
        "dropped": _DROPPED,
        "value": _packed(_codes(data)),
        "cause": _packed(data.cause.transpose(2, 1, 0)),
        "pick": _packed(data.pick.T.astype("<u2")),
        "lines": [
            {
                "x": _rounded(line.x),
                "y": [None if np.isnan(y) else round(float(y), 2) for y in line.y],
                "branch": line.branch.tolist(),
                "changes": line.changes.tolist(),
            }
            for line in data.lines
        ],
    }


def _traces(data: MapData, name: str) -> list[dict[str, Any]]:
    """Return the traces without the numbers of the map, which the page fills in."""
    where = "" if data.numbered else f"{html.escape(data.x_label)}: %{{x:.6~g}}<br>"
    hover = f"<b>%{{text}}</b><br>{where}{html.escape(data.angle_name)}: %{{y:.2~f}} deg"
    low, high = data.limits() or (0.0, 1.0)
    convert = np.log10 if is_log((low, high)) else np.asarray
    ends = [float(end) for end in convert(np.array([low, high]))]
    ticks = log_ticks((low, high)) if is_log((low, high)) else round_ticks((low, high))
    named = [(tick, f"{tick:g}") for tick in ticks]
    best = data.layer(None)[0]
    if (best > high).any():
        # A tick too near to the end would be written over.
        room = ends[1] - 0.04 * (ends[1] - ends[0])
        named = [(tick, text) for tick, text in named if float(convert(tick)) < room] + [(high, f"≥ {high:.3g}")]
    bar = {
        "title": {"text": name, "side": "right"},
        "tickvals": [float(convert(tick)) for tick, _ in named],
        "ticktext": [text for _, text in named],
        "outlinewidth": 0,
    }
    bands = len(CAUSES) - 1
    scale = [[share / bands, CAUSE_COLORS[code]] for code in range(1, bands + 1) for share in (code - 1, code)]
    traces: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "colorscale": "Viridis",
            "reversescale": True,
            "zmin": ends[0],
            "zmax": ends[1],
            "showscale": data.limits() is not None,
            "colorbar": bar,
            "hoverongaps": False,
            "hovertemplate": f"{hover}<br>{name}: %{{customdata:.4~g}}<extra></extra>",
        },
        {
            "type": "heatmap",
            "colorscale": scale,
            "zmin": 0.5,
            "zmax": bands + 0.5,
            "showscale": False,
            "hoverongaps": False,
            "hovertemplate": f"{hover}<extra></extra>",
        },
    ]
    for code in BY_BADNESS[1:]:
        if (data.cause == code).any():
            square = {"symbol": "square", "size": 11, "color": CAUSE_COLORS[code]}
            traces.append(_curve(mode="markers", marker=square, name=CAUSES[code], x=[None], y=[None]))
    borders = {"color": BLACK, "width": 1}
    traces.append(_curve(meta="borders", line=borders, name="borders of the best branch"))
    for i, line in enumerate(data.lines):
        color = LINE_COLORS[i % len(LINE_COLORS)]
        one = {"legendgroup": f"line {i}"}
        dots = {"color": color, "size": 8, "line": {"color": BLACK, "width": 1.5}}
        label = html.escape(line.label)
        dotted = {"color": color, "width": 2, "dash": "dot"}
        shade = {"color": BLACK, "width": 4}
        traces.append(_curve(meta=f"shade {i}", line=shade, opacity=0.5, showlegend=False, **one))
        traces.append(_curve(meta=f"off {i}", line=dotted, showlegend=False, **one))
        traces.append(_curve(meta=f"border {i}", line={"color": BLACK, "width": 5}, showlegend=False, **one))
        traces.append(_curve(meta=f"on {i}", line={"color": color, "width": 2.5}, showlegend=False, **one))
        traces.append(_curve(meta=f"dots {i}", mode="markers", marker=dots, showlegend=False, **one))
        # In the legend there is no line upon a line.
        thin = {"color": BLACK, "width": 1.5}
        traces.append(_curve(mode="lines+markers", marker=dots, line=thin, name=label, x=[None], y=[None], **one))
    return traces


def _curve(**properties: object) -> dict[str, Any]:
    return {"type": "scatter", "mode": "lines", "hoverinfo": "skip", **properties}


def _layout(data: MapData) -> dict[str, Any]:
    edges = edges_of(data.x)
    ends = [float(edges[0]), float(edges[-1])]
    axis = {"showgrid": False, "zeroline": False, "ticks": "outside", "showline": True, "mirror": True}
    turn = {"range": [-180, 180], "minallowed": -180, "maxallowed": 180, "tick0": 0, "dtick": 60}
    along = {"range": ends, "minallowed": ends[0], "maxallowed": ends[1]}
    return {
        "template": "none",
        "xaxis": {**axis, **along, "title": {"text": html.escape(data.x_label)}},
        "yaxis": {**axis, **turn, "title": {"text": f"{html.escape(data.angle_name)} [deg]"}},
        "legend": {"orientation": "h", "y": -0.14, "yanchor": "top", "itemclick": False, "itemdoubleclick": False},
        "margin": {"l": 70, "r": 20, "t": 32, "b": 90},
        "hovermode": "closest",
        "hoverlabel": {"bgcolor": WHITE, "font": {"color": BLACK}, "align": "left"},
        # The same for every branch: a zoom stays.
        "uirevision": "map",
    }


def _rounded(x: F64) -> list[float]:
    return [float(f"{v:.9g}") for v in x]


def _codes(data: MapData) -> NDArray[np.uint8]:
    """Return the leading bits of the values as float32: differences along the path, a plane for each byte."""
    value = np.where(data.cause == 0, np.clip(data.value, -1e38, 1e38), 0.0).astype(np.float32).transpose(2, 1, 0)
    bits = np.ascontiguousarray(value).view(np.uint32)
    # Half of the last bit that is kept, so that it is rounded.
    code = (bits + np.uint32(1 << (_DROPPED - 1))) >> np.uint32(_DROPPED)
    step = np.diff(code, axis=2, prepend=np.uint32(0)) & np.uint32(0xFFFFFF)
    return np.stack([(step >> np.uint32(shift)).astype(np.uint8) for shift in (0, 8, 16)])


def _packed(array: NDArray[Any]) -> str:
    return base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 6)).decode("ascii")
