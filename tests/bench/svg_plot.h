#pragma once

// Line plots as SVG, enough for a table's worth of points.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

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
constexpr double legend_row = 18;

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

inline std::string text(double x, double y, const char* anchor, const std::string& content) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     content);
}

/// The least of 1, 2, 5, 10 and so on that divides a range into eight parts at the most.
inline double round_step(double range) {
  const double decade = std::pow(10.0, std::floor(std::log10(range / 8)));
  for (const double times : {1.0, 2.0, 5.0})
    if (times * decade * 8 >= range) return times * decade;
  return 10 * decade;
}

inline std::string frame(const Plot& plot, const Axes& axes) {
  std::string out =
      text(left, 18, "start", "<tspan font-weight=\"bold\">" + plot.title + "</tspan>");
  for (double decade = std::floor(axes.y_low); decade <= axes.y_high; decade += 1) {
    for (int step = 1; step < 10; ++step) {
      const double value = step * std::pow(10.0, decade);
      if (std::log10(value) < axes.y_low - 1e-9 || std::log10(value) > axes.y_high + 1e-9) continue;
      const bool labelled = step == 1 || step == 3;
      out += fmt::format(
          "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", left,
          width - right, axes.y(value), axes.y(value), labelled ? "#cccccc" : "#f0f0f0");
      if (labelled) out += text(left - 6, axes.y(value) + 4, "end", fmt::format("{:.3g}", value));
    }
  }
  const double step = round_step(axes.x_high - axes.x_low);
  for (double n = std::ceil(axes.x_low / step - 1e-9); n * step <= axes.x_high + 1e-9 * step; ++n)
    out += text(axes.x(n * step), height - bottom + 16, "middle", fmt::format("{:.3g}", n * step));
  return out + text(0.5 * (left + width - right), height - 6, "middle", plot.x_label);
}

inline std::string lines(const Plot& plot, const Axes& axes) {
  std::string out;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const char* colour = colours[i % std::size(colours)];
    std::string path;
    for (const auto& [x, y] : plot.series[i].points) {
      if (!(y > 0)) continue;
      path += fmt::format("{:.1f},{:.1f} ", axes.x(x), axes.y(y));
      out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\" fill=\"{}\"/>\n", axes.x(x),
                         axes.y(y), colour);
    }
    out +=
        fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n",
                    path, colour);
  }
  return out;
}

constexpr std::size_t plots_per_row = 2;
constexpr std::size_t names_per_row = 5;

constexpr std::size_t row_count(std::size_t count, std::size_t per_row) {
  return (count + per_row - 1) / per_row;
}

/// The names of the series in rows, below all plots.
inline std::string legend(const std::vector<Series>& series, double y) {
  std::string out;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const std::size_t row = i / names_per_row;
    const double x =
        left + static_cast<double>(i % names_per_row) * (2 * width - left) / names_per_row;
    const double row_top = y + legend_row * static_cast<double>(row);
    out += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"10\" height=\"10\" fill=\"{}\"/>\n",
                       x, row_top, colours[i % std::size(colours)]);
    out += text(x + 15, row_top + 9, "start", series[i].name);
  }
  return out;
}

}  // namespace svg

/// The plots side by side; all of the same series.
inline std::string svg_of(const std::vector<Plot>& plots) {
  const double plots_height =
      svg::height * static_cast<double>(svg::row_count(plots.size(), svg::plots_per_row));
  const std::size_t legend_rows = svg::row_count(plots.front().series.size(), svg::names_per_row);
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" "
      "font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      2 * svg::width, plots_height + svg::legend_row * static_cast<double>(legend_rows + 1));
  for (std::size_t i = 0; i < plots.size(); ++i) {
    const svg::Axes axes = svg::axes_of(plots[i]);
    const std::size_t row = i / svg::plots_per_row;
    const std::size_t column = i % svg::plots_per_row;
    out += fmt::format("<g transform=\"translate({},{})\">\n",
                       static_cast<double>(column) * svg::width,
                       static_cast<double>(row) * svg::height);
    out += svg::frame(plots[i], axes) + svg::lines(plots[i], axes) + "</g>\n";
  }
  return out + svg::legend(plots.front().series, plots_height + 0.5 * svg::legend_row) + "</svg>\n";
}

}  // namespace scarp::bench
