"use strict";
(function () {
  var drawn = {}, printing = false, units = 0;
  function each(selector, run, root) {
    Array.prototype.forEach.call((root || document).querySelectorAll(selector), run);
  }
  function element(tag, text, parent) {
    var made = document.createElement(tag);
    if (text) { made.textContent = text; }
    parent.appendChild(made);
    return made;
  }
  function colour(trace) {
    return (trace.line && trace.line.color) || (trace.marker && trace.marker.color) || "#888";
  }
  var STYLES = { dash: "dashed", longdash: "dashed", dashdot: "dashed", longdashdot: "dashed", dot: "dotted" };
  function scaled(values, factor) {
    return values.map(function (v) { return v === null ? null : v * factor; });
  }

  // -- drawing, and what a reader may change --------------------------------------------------

  function trace(figure, original) {
    var unit = figure.units[Math.min(units, figure.units.length - 1)];
    if (!unit || unit[1] === 1) { return original; }
    var copy = Object.assign({}, original, { y: scaled(original.y, unit[1]) });
    if (original.si) { copy.text = original.si; }
    if (original.error_y) {
      copy.error_y = Object.assign({}, original.error_y, {
        array: scaled(original.error_y.array, unit[1]),
        arrayminus: scaled(original.error_y.arrayminus, unit[1])
      });
    }
    return copy;
  }
  function laid(figure, place) {
    var layout = JSON.parse(JSON.stringify(figure.layout));
    var unit = figure.units[Math.min(units, figure.units.length - 1)];
    if (unit) {
      layout.yaxis.title.text = unit[0];
      if (layout.yaxis.range) {
        layout.yaxis.range = layout.yaxis.type === "log"
          ? layout.yaxis.range.map(function (v) { return v + Math.log10(unit[1]); })
          : scaled(layout.yaxis.range, unit[1]);
      }
    }
    if (printing) {
      var node = document.getElementById(place);
      layout.width = node.parentNode.dataset.width === "half" ? 335 : 690;
      layout.height = Math.round(0.45 * layout.height);
      layout.font.size = 10;
      // The title of the y axis is longer than the axis is high: it goes above.
      layout.margin = { l: 42, r: 12, t: 17, b: 34 };
      layout.annotations = [{ text: layout.yaxis.title.text, showarrow: false, xref: "paper",
        yref: "paper", x: 0, y: 1, xanchor: "left", yanchor: "bottom", xshift: -40 }];
      layout.yaxis.title.text = "";
    }
    return layout;
  }
  function draw(place) {
    var figure = drawn[place];
    Plotly.react(place, figure.data.map(function (t) { return trace(figure, t); }),
      laid(figure, place), figure.config);
  }
  function legend(place, figure) {
    var bar = document.querySelector('[data-legend="' + place + '"]');
    if (!bar) { return; }
    figure.toggles.forEach(function (index) {
      var first = figure.data[index], label = element("label", "", bar);
      var box = element("input", "", label);
      box.type = "checkbox"; box.checked = first.visible !== false; box.dataset.trace = index;
      var swatch = element("span", "", label);
      swatch.className = "swatch " + (first.line ? STYLES[first.line.dash] || "" : "points");
      swatch.style.color = /^#(000000|444444)$/.test(colour(first))
        ? "var(--" + (colour(first) === "#000000" ? "ink" : "data") + ")" : colour(first);
      element("span", first.name, label);
      box.addEventListener("change", function () {
        figure.data.forEach(function (other, i) {
          if (i === index || (first.legendgroup && other.legendgroup === first.legendgroup) ||
              other.legendgroup === first.name) { other.visible = box.checked; }
        });
        draw(place);
      });
    });
    var caption = bar.parentNode.querySelector("figcaption");
    var csv = element("button", "CSV", caption);
    csv.type = "button"; csv.dataset.csv = place;
    csv.title = "every curve of this figure as a file";
    csv.addEventListener("click", function () { save(place + ".csv", table(place)); });
  }
  function table(place) {
    var figure = drawn[place], lines = ["curve,x,y,lower,upper"];
    var unit = figure.units[Math.min(units, figure.units.length - 1)] ||
      [figure.layout.yaxis.title.text, 1];
    lines.unshift("# x: " + figure.layout.xaxis.title.text + "; y: " + unit[0]);
    figure.data.forEach(function (original) {
      var t = trace(figure, original);
      t.x.forEach(function (x, i) {
        // A residual beyond the axis is drawn at its edge.
        var y = t.customdata ? t.customdata[i][0] : t.y[i], bars = t.error_y, show = function (v) { return v === null ? "" : +v.toPrecision(6); };
        if (y === null) { return; }
        // A name that begins a formula in a spreadsheet is kept as text.
        var name = '"' + original.name.replace(/"/g, '""').replace(/^([=+\-@])/, "'$1") + '"';
        lines.push([name, x, show(y), bars ? show(y - bars.arrayminus[i]) : "",
          bars ? show(y + bars.array[i]) : ""].join(","));
      });
    });
    return lines.join("\n") + "\n";
  }
  function save(name, text) {
    var link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    link.download = name;
    link.click();
    setTimeout(function () { URL.revokeObjectURL(link.href); }, 1000);
  }
  each("script[data-plot]", function (source) {
    var place = source.dataset.plot, figure = JSON.parse(source.textContent);
    drawn[place] = figure;
    legend(place, figure);
    Plotly.newPlot(place, figure.data, laid(figure, place), figure.config);
  });

  // -- what if a filter believed other numbers ------------------------------------------------

  function readable(value) { return Number(value.toPrecision(3)).toString(); }
  function moved(place) {
    var figure = drawn[place], now = {};
    each('input[data-whatif="' + place + '"]', function (slider) {
      var value = Number(slider.dataset.start) * Math.pow(10, Number(slider.value));
      now[slider.dataset.letter] = value;
      slider.nextElementSibling.textContent = units === 0
        ? readable(value * Number(slider.dataset.factor)) + " " + slider.dataset.field
        : value.toExponential(2) + " " + slider.dataset.si;
    });
    figure.data.forEach(function (t) {
      if (t.name === figure.whatif.curve) {
        t.y = t.x.map(function (tau) {
          return figure.whatif.factor * Math.sqrt(now.N * now.N / tau + now.K * now.K * tau / 3);
        });
      }
    });
  }
  each("input[data-whatif]", function (slider) {
    var place = slider.dataset.whatif;
    moved(place);
    slider.addEventListener("input", function () {
      drawn[place].data.forEach(function (t, i) {
        if (t.name === drawn[place].whatif.curve) {
          t.visible = true;
          document.querySelector('[data-legend="' + place + '"] [data-trace="' + i + '"]').checked = true;
        }
      });
      moved(place); draw(place);
    });
  });
  each("button[data-reset]", function (button) {
    button.addEventListener("click", function () {
      var place = button.dataset.reset;
      each('input[data-whatif="' + place + '"]', function (slider) { slider.value = 0; });
      moved(place); draw(place);
    });
  });

  // -- units, copies -----------------------------------------------------------------

  each("select[data-units]", function (select) {
    select.addEventListener("change", function () {
      units = select.value === "si" ? 1 : 0;
      document.body.className = units ? "units-si" : "units-field";
      Object.keys(drawn).forEach(function (place) {
        if (drawn[place].whatif) { moved(place); }
        draw(place);
      });
    });
  });
  function copied(button, ok) {
    var before = button.textContent;
    button.textContent = ok ? "copied" : "select the text below";
    setTimeout(function () { button.textContent = before; }, 1500);
  }
  each("button[data-copy]", function (button) {
    button.addEventListener("click", function () {
      var shown = document.getElementById(button.dataset.copy);
      each("pre", function (other) { other.hidden = other !== shown; }, shown.parentNode);
      var range = document.createRange();
      range.selectNodeContents(shown);
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      var old = function () { copied(button, document.execCommand("copy")); };
      if (navigator.clipboard && window.isSecureContext) {
        navigator.clipboard.writeText(shown.textContent).then(function () { copied(button, true); }, old);
      } else { old(); }
    });
  });

  // -- paper ----------------------------------------------------------------------------------

  function paper(on) {
    printing = on;
    each("details.printed", function (box) {
      if (on) { box.dataset.open = box.open ? "1" : ""; box.open = true; } else { box.open = box.dataset.open === "1"; }
    });
    Object.keys(drawn).forEach(draw);
  }
  addEventListener("beforeprint", function () { paper(true); });
  addEventListener("afterprint", function () { paper(false); });
}());
