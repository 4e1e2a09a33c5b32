#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

namespace scarp {

// What all SVG pictures are made of, as text. Units: px, y downwards.

/// Text between tags and in attributes: without the control characters that XML has no way to
/// write.
std::string escaped(const std::string& text);

/// A picture that is a file of its own, on white paper.
std::string svg_picture(double width, double height, double font_size, const std::string& content);

/// A line of text; anchor is the part of it that lies at x: "start", "middle" or "end".
std::string svg_text(double x, double y, const std::string& text, const char* anchor = "start");

/// A line through points, as the attribute d of a path has it.
std::string svg_line(std::span<const std::array<double, 2>> points, int decimals = 1);

/// The least of 1, 2 and 5 times a power of ten that is not below a number, and the greatest that
/// is not above it.
double rounded_up(double number);
double rounded_down(double number);

/// Round numbers within a range, at equal distances that divide it into so many parts at most.
std::vector<double> ticks_within(double low, double high, int parts);

/// Places for the names of a legend: side by side in rows.
class LegendRows {
 public:
  /// y: of the first row. No name reaches beyond right, unless it has a row to itself.
  LegendRows(double left, double right, double y, double row_height)
      : left_(left), right_(right), row_height_(row_height), x_(left), y_(y) {}

  /// The place of the next name, which takes so much of a row with what stands beside it.
  std::array<double, 2> place(double width);

  /// Of the rows below the first.
  double more_height() const { return more_height_; }

 private:
  double left_;
  double right_;
  double row_height_;
  double x_;
  double y_;
  double more_height_ = 0;
};

}  // namespace scarp
