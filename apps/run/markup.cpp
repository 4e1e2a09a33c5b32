#include "apps/run/markup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/run/svg.h"
#include "apps/viewer/viewer_script.h"
#include "core/system/base64.h"

namespace scarp {

namespace {

constexpr double width = 520;    // px
constexpr double height = 270;   // px, of a plot whose scales are its own
constexpr double tallest = 760;  // px, of one with equal scales
constexpr double left = 76;
constexpr double right = 16;
constexpr double top = 28;
constexpr double bottom = 64;

using Point = std::array<double, 2>;

struct Range {
  double low = 1e300;
  double high = -1e300;

  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double size() const { return high - low; }
  std::vector<double> ticks() const { return ticks_within(low, high, 5); }
  void widen() {
    if (low > high) low = high = 0;
    // What differs by its rounding alone is one value: places on a mesh are single precision.
    const double rounding = 1e-5 * std::max(std::abs(low), std::abs(high));
    const double room = size() > rounding ? 0.04 * size() : std::max(1.0, std::abs(low));
    low -= room;
    high += room;
  }
};

/// What stands at the ticks: with as many digits as tell them apart.
std::vector<std::string> labels_of(const std::vector<double>& ticks) {
  const double largest =
      ticks.empty() ? 0 : std::max(std::abs(ticks.front()), std::abs(ticks.back()));
  int digits = 6;
  if (ticks.size() > 1 && largest > 0)
    digits = std::max(digits,
                      1 + static_cast<int>(std::ceil(std::log10(largest / (ticks[1] - ticks[0])))));
  std::vector<std::string> labels;
  labels.reserve(ticks.size());
  for (const double tick : ticks) labels.push_back(fmt::format("{:.{}g}", tick, digits));
  return labels;
}

/// Where values lie on the paper.
struct Axes {
  std::array<Range, 2> ranges;
  std::array<double, 2> pixels;  ///< per unit
  double bottom_edge = 0;

  double x(double value) const { return left + (value - ranges[0].low) * pixels[0]; }
  double y(double value) const { return bottom_edge - (value - ranges[1].low) * pixels[1]; }
};

Axes axes_of(const Plot& plot) {
  Axes axes{};
  for (const Curve& curve : plot.curves) {
    for (const auto& line : curve.lines) {
      for (const Point& point : line) {
        axes.ranges[0].add(point[0]);
        axes.ranges[1].add(point[1]);
      }
    }
  }
  for (Range& range : axes.ranges) range.widen();
  const double room = width - left - right;
  axes.pixels[0] = room / axes.ranges[0].size();
  axes.pixels[1] = (height - top - bottom) / axes.ranges[1].size();
  if (plot.has_equal_scales) {
    axes.pixels[0] = std::min(axes.pixels[0], (tallest - top - bottom) / axes.ranges[1].size());
    axes.pixels[1] = axes.pixels[0];
  }
  axes.bottom_edge = top + axes.ranges[1].size() * axes.pixels[1];
  return axes;
}

std::string grid_of(const Plot& plot, const Axes& axes) {
  const double end = axes.x(axes.ranges[0].high);
  std::string svg =
      fmt::format("<text x=\"{}\" y=\"18\" class=\"title\">{}</text>\n", left, escaped(plot.title));
  const std::vector<double> across = axes.ranges[0].ticks();
  const std::vector<double> upwards = axes.ranges[1].ticks();
  const std::vector<std::string> labels_across = labels_of(across);
  const std::vector<std::string> labels_upwards = labels_of(upwards);
  for (std::size_t n = 0; n < across.size(); ++n) {
    svg += fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>\n", axes.x(across[n]),
                       top, axes.bottom_edge);
    svg += svg_text(axes.x(across[n]), axes.bottom_edge + 16, labels_across[n], "middle");
  }
  for (std::size_t n = 0; n < upwards.size(); ++n) {
    svg += fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>\n", left,
                       axes.y(upwards[n]), end);
    svg += svg_text(left - 6, axes.y(upwards[n]) + 4, labels_upwards[n], "end");
  }
  svg += svg_text(0.5 * (left + end), axes.bottom_edge + 34, plot.x_label, "middle");
  const double middle = 0.5 * (top + axes.bottom_edge);
  svg += fmt::format(
      "<text transform=\"translate(14 {:.1f}) rotate(-90)\" "
      "text-anchor=\"middle\">{}</text>\n",
      middle, escaped(plot.y_label));
  return svg;
}

/// Beyond the colours that the style has they begin anew, dashed.
std::string classes_of(const Curve& curve) {
  constexpr std::size_t colours = 6;
  const bool is_dashed = curve.is_dashed || curve.colour >= colours;
  return fmt::format("curve c{}{}", curve.colour % colours, is_dashed ? " dashed" : "");
}

std::string curve_path(const Curve& curve, const Axes& axes) {
  std::string path;
  for (const auto& line : curve.lines) {
    std::vector<Point> points;
    points.reserve(line.size());
    for (const Point& point : line) points.push_back({axes.x(point[0]), axes.y(point[1])});
    path += svg_line(points);
  }
  return fmt::format("<path class=\"{}\" d=\"{}\"/>\n", classes_of(curve), path);
}

struct Legend {
  std::string svg;
  double height = 0;  ///< px
};

/// Names in rows that end within the picture.
Legend legend_of(const Plot& plot, double y) {
  constexpr double letter_width = 6.6;  // px, on average
  LegendRows rows(left, width, y, 18);
  std::string svg;
  for (const Curve& curve : plot.curves) {
    if (curve.name.empty()) continue;
    const auto [x, baseline] =
        rows.place(44 + letter_width * static_cast<double>(curve.name.size()));
    svg += fmt::format("<path class=\"{}\" d=\"M{:.1f} {:.1f}h22\"/>\n", classes_of(curve), x,
                       baseline - 4);
    svg += svg_text(x + 28, baseline, curve.name);
  }
  return {.svg = svg, .height = rows.more_height()};
}

// Colours that stay apart in print and for colour-blind readers (after Okabe and Ito 2008).
constexpr const char* style = R"(
:root { color-scheme: light dark; --ink: #1c1c1c; --paper: #ffffff; --line: #d4d4d4;
  --good: #1a7f37; --bad: #c1121f; --unsure: #9a6700; --c0: #0072b2; --c1: #d55e00; --c2: #009e73; --c3: #8c6bb1;
  --c4: #b8860b; --c5: #666666; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e6e6; --paper: #15181c; --line: #3a3f46;
  --good: #57c26e; --bad: #ff7b72; --unsure: #e3b341; --c0: #56b4e9; --c1: #ff9f45; --c2: #3ddbab; --c3: #c4a5e8;
  --c4: #e8d44d; --c5: #a8a8a8; } }
@media print { :root { --ink: #000; --paper: #fff; --line: #bbb; --good: #1a7f37; --bad: #c1121f; --unsure: #9a6700;
  --c0: #0072b2; --c1: #d55e00; --c2: #009e73; --c3: #8c6bb1; --c4: #b8860b; --c5: #666666; } details { break-inside: avoid; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 1000px;
  margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; font-size: 13px; display: block; overflow-x: auto; }
th, td { padding: 3px 10px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
.good { color: var(--good); } .bad { color: var(--bad); font-weight: bold; } .unsure { color: var(--unsure); }
svg { width: 100%; height: auto; max-width: 600px; font: 12px system-ui, sans-serif; }
svg text { fill: var(--ink); } svg .title { font-weight: bold; } svg .grid { stroke: var(--line); fill: none; }
svg .curve { fill: none; stroke-width: 1.5; } svg .dashed { stroke-dasharray: 5 3; }
svg .c0 { stroke: var(--c0); } svg .c1 { stroke: var(--c1); } svg .c2 { stroke: var(--c2); } svg .c3 { stroke: var(--c3); }
svg .c4 { stroke: var(--c4); } svg .c5 { stroke: var(--c5); }
svg .bar { stroke-width: 26; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 440px), 1fr)); gap: 8px 24px; }
img { display: block; max-width: 100%; height: auto; margin: 0.6em 0; border-radius: 4px; }
pre { overflow-x: auto; font-size: 12px; } .note { font-size: 13px; opacity: 0.75; }
@media print { svg, img, tr { break-inside: avoid; } h2 { break-after: avoid; } body { font-size: 11pt; max-width: none;
  margin: 0; } pre { white-space: pre-wrap; } }
)";

/// The script, where there is something for it to show.
std::string viewer_of(const std::string& body) {
  if (body.find("<div class=\"scene\"") == std::string::npos) return "";
  return fmt::format("<script>{}</script>\n", viewer_script());
}

}  // namespace

std::string plot_svg(const Plot& plot) {
  const Axes axes = axes_of(plot);
  const Legend legend = legend_of(plot, axes.bottom_edge + bottom - 8);
  std::string svg =
      fmt::format("<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\">\n", width,
                  axes.bottom_edge + bottom + legend.height, escaped(plot.title));
  svg += grid_of(plot, axes);
  for (const Curve& curve : plot.curves) svg += curve_path(curve, axes);
  return svg + legend.svg + "</svg>\n";
}

std::string bar_svg(const std::string& title, const std::string& unit,
                    std::span<const BarPart> parts) {
  double sum = 0;
  for (const BarPart& part : parts) sum += part.value;
  const double scale = sum > 0 ? (width - left - right) / sum : 0;
  constexpr double middle = 52;      // px, of the bar
  constexpr double row_height = 20;  // px, of the legend
  std::string svg = fmt::format("<text x=\"{}\" y=\"18\" class=\"title\">{}: {:.3g} {}</text>\n",
                                left, escaped(title), sum, escaped(unit));
  double x = left;
  double y = middle + 40;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const double length = parts[n].value * scale;
    svg += fmt::format("<path class=\"bar c{}\" d=\"M{:.1f} {}h{:.1f}\"/>\n", n, x, middle, length);
    svg += fmt::format("<path class=\"bar c{}\" d=\"M{} {}h14\" style=\"stroke-width:12\"/>\n", n,
                       left, y - 4);
    const double share = sum > 0 ? 100 * parts[n].value / sum : 0;
    svg += svg_text(
        left + 22, y,
        fmt::format("{}: {:.3g} {} ({:.0f} %)", parts[n].name, parts[n].value, unit, share));
    x += length;
    y += row_height;
  }
  return fmt::format("<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\">\n{}</svg>\n",
                     width, y, escaped(title), svg);
}

std::string embedded_picture(const std::string& type, std::string_view bytes,
                             const std::string& meaning) {
  return fmt::format("<img alt=\"{}\" src=\"data:{};base64,{}\">\n", escaped(meaning), type,
                     base64(bytes));
}

std::string html_table(std::span<const std::string> head,
                       std::span<const std::vector<TableCell>> rows) {
  std::string html = "<table>\n<tr>";
  for (const std::string& name : head) html += "<th>" + escaped(name) + "</th>";
  html += "</tr>\n";
  for (const std::vector<TableCell>& row : rows) {
    html += "<tr>";
    for (const TableCell& cell : row) {
      html += cell.css_class.empty() ? "<td>" : "<td class=\"" + cell.css_class + "\">";
      html += escaped(cell.text) + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n{}{}</body>\n</html>\n",
      escaped(title), style, body, viewer_of(body));
}

}  // namespace scarp
