#include "apps/run/svg.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace scarp {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";  // "]]>" ends what XML has opened elsewhere
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return out;
}

std::string svg_picture(double width, double height, double font_size, const std::string& content) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\" font-size=\"{2:g}\" "
      "fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{3}</svg>\n",
      width, height, font_size, content);
}

std::string svg_text(double x, double y, const std::string& text, const char* anchor) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     escaped(text));
}

std::string svg_line(std::span<const std::array<double, 2>> points, int decimals) {
  std::string path;
  char move = 'M';
  for (const auto& [x, y] : points)
    path += fmt::format("{}{:.{}f} {:.{}f}", std::exchange(move, 'L'), x, decimals, y, decimals);
  return path;
}

double rounded_up(double number) {
  const double decade = std::pow(10.0, std::floor(std::log10(number)));
  const double mantissa = number / decade;
  return decade * (mantissa > 5 ? 10 : mantissa > 2 ? 5 : mantissa > 1 ? 2 : 1);
}

double rounded_down(double number) {
  const double decade = std::pow(10.0, std::floor(std::log10(number)));
  const double mantissa = number / decade;
  return decade * (mantissa >= 5 ? 5 : mantissa >= 2 ? 2 : 1);
}

std::vector<double> ticks_within(double low, double high, int parts) {
  const double step = rounded_up((high - low) / parts);
  std::vector<double> ticks;
  for (double n = std::ceil(low / step); n * step <= high; ++n)
    ticks.push_back(n == 0 ? 0 : n * step);
  return ticks;
}

std::array<double, 2> LegendRows::place(double width) {
  if (x_ > left_ && x_ + width > right_) {
    x_ = left_;
    more_height_ += row_height_;
  }
  return {std::exchange(x_, x_ + width), y_ + more_height_};
}

}  // namespace scarp
