#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace scarp {

// Pages as HTML has them, with the plots in them as SVG.

/// Lines of one kind in a plot.
struct Curve {
  std::string name;
  std::size_t colour = 0;  ///< its number among those of a page, from 0
  bool is_dashed = false;
  std::vector<std::vector<std::array<double, 2>>> lines;
};

/// Curves over two axes.
struct Plot {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<Curve> curves;
  bool has_equal_scales = false;  ///< as of a cross-section
};

/// The plot as an <svg> element for a page: its colours are those of the page.
std::string plot_svg(const Plot& plot);

/// A share of a whole. Units: those of the bar.
struct BarPart {
  std::string name;
  double value = 0;
};

/// What a sum consists of, as one bar in an <svg> element.
std::string bar_svg(const std::string& title, const std::string& unit,
                    std::span<const BarPart> parts);

/// A picture within the page; the type is that of its bytes ("image/png").
std::string embedded_picture(const std::string& type, std::string_view bytes,
                             const std::string& meaning);

/// A cell of a table; the class is one of those of a page ("good", "bad", "unsure") or empty.
struct TableCell {
  std::string text;
  std::string css_class{};
};

/// A table with a head; the first cell of a row is its name.
std::string html_table(std::span<const std::string> head,
                       std::span<const std::vector<TableCell>> rows);

/// A whole page that needs no other file, legible in light, in dark and printed. With the viewer
/// where the body has a scene for it.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace scarp
