#pragma once

// Line plots as SVG, enough for a table's worth of points.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "apps/run/svg.h"

namespace scarp::bench {

struct Series {
  std::string name;
  std::vector<std::pair<double, double>> points;  ///< x and y; y > 0
};

/// One plot with a logarithmic y axis.
struct Plot {
  std::string title;
  std::string x_label;
  std::vector<Series> series;
};

namespace svg {

constexpr double width = 420;
constexpr double height = 300;
constexpr double left = 66;
constexpr double right = 14;
constexpr double top = 30;
constexpr double bottom = 40;
constexpr const char* colours[]{"#0b6e99", "#56b4e9", "#c8553d", "#6a994e", "#7b2d8b",
                                "#111111", "#8a8a8a", "#d9a441", "#e377c2", "#7a5230"};

struct Axes {
  double x_low = 0;
  double x_high = 1;
  double y_low = 0;  ///< logarithms to base 10
  double y_high = 1;

  double x(double value) const {
    return left + (value - x_low) / (x_high - x_low) * (width - left - right);
  }
  double y(double value) const {
    return height - bottom -
           (std::log10(value) - y_low) / (y_high - y_low) * (height - top - bottom);
  }
};

inline Axes axes_of(const Plot& plot) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double x_low = infinity;
  double x_high = -infinity;
  double y_low = infinity;
  double y_high = -infinity;
  for (const Series& series : plot.series) {
    for (const auto& [x, y] : series.points) {
      x_low = std::min(x_low, x);
      x_high = std::max(x_high, x);
      if (!(y > 0)) continue;
      y_low = std::min(y_low, std::log10(y));
      y_high = std::max(y_high, std::log10(y));
    }
  }
  if (!(x_high > x_low) || !(y_high >= y_low)) return {};
  return {x_low, x_high, std::floor(2 * y_low) / 2,
          std::max(std::floor(2 * y_low + 1) / 2, std::ceil(2 * y_high) / 2)};
}

inline std::string frame(const Plot& plot, const Axes& axes) {
  std::string out = "<g font-weight=\"bold\">" + svg_text(left, 18, plot.title) + "</g>\n";
  for (double decade = std::floor(axes.y_low); decade <= axes.y_high; decade += 1) {
    for (int step = 1; step < 10; ++step) {
      const double value = step * std::pow(10.0, decade);
      if (std::log10(value) < axes.y_low - 1e-9 || std::log10(value) > axes.y_high + 1e-9) continue;
      const bool labelled = step == 1 || step == 3;
      out += fmt::format("<path d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"{}\"/>\n", left, axes.y(value),
                         width - right, labelled ? "#cccccc" : "#f0f0f0");
      if (labelled)
        out += svg_text(left - 6, axes.y(value) + 4, fmt::format("{:.3g}", value), "end");
    }
  }
  // Rounding takes no tick away from the ends.
  const double rounding = 1e-9 * (axes.x_high - axes.x_low);
  for (const double tick : ticks_within(axes.x_low - rounding, axes.x_high + rounding, 8))
    out += svg_text(axes.x(tick), height - bottom + 16, fmt::format("{:.3g}", tick), "middle");
  return out + svg_text(0.5 * (left + width - right), height - 6, plot.x_label, "middle");
}

inline std::string lines(const Plot& plot, const Axes& axes) {
  std::string out;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const char* colour = colours[i % std::size(colours)];
    std::vector<std::array<double, 2>> points;
    for (const auto& [x, y] : plot.series[i].points) {
      if (!(y > 0)) continue;
      points.push_back({axes.x(x), axes.y(y)});
      out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\" fill=\"{}\"/>\n",
                         points.back()[0], points.back()[1], colour);
    }
    out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n",
                       svg_line(points), colour);
  }
  return out;
}

constexpr std::size_t plots_per_row = 2;
constexpr double legend_row = 18;

struct Legend {
  std::string svg;
  double height = 0;
};

/// The names of the series in rows, below all plots.
inline Legend legend(const std::vector<Series>& series, double y) {
  constexpr double letter_width = 7;
  LegendRows rows(left, plots_per_row * width, y, legend_row);
  std::string out;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const auto [x, row] =
        rows.place(30 + letter_width * static_cast<double>(series[i].name.size()));
    out += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"10\" height=\"10\" fill=\"{}\"/>\n",
                       x, row, colours[i % std::size(colours)]);
    out += svg_text(x + 15, row + 9, series[i].name);
  }
  return {out, 2 * legend_row + rows.more_height()};
}

}  // namespace svg

/// The plots side by side; all of the same series.
inline std::string svg_of(const std::vector<Plot>& plots) {
  const std::size_t rows = (plots.size() + svg::plots_per_row - 1) / svg::plots_per_row;
  const double plots_height = svg::height * static_cast<double>(rows);
  std::string out;
  for (std::size_t i = 0; i < plots.size(); ++i) {
    const svg::Axes axes = svg::axes_of(plots[i]);
    const std::size_t row = i / svg::plots_per_row;
    const std::size_t column = i % svg::plots_per_row;
    out += fmt::format("<g transform=\"translate({},{})\">\n",
                       static_cast<double>(column) * svg::width,
                       static_cast<double>(row) * svg::height);
    out += svg::frame(plots[i], axes) + svg::lines(plots[i], axes) + "</g>\n";
  }
  const svg::Legend legend =
      svg::legend(plots.front().series, plots_height + 0.5 * svg::legend_row);
  return svg_picture(svg::plots_per_row * svg::width, plots_height + legend.height, 11,
                     out + legend.svg);
}

}  // namespace scarp::bench
