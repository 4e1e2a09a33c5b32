#include "apps/run/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/run/svg.h"
#include "core/plain_number.h"
#include "core/system/atomic_file.h"

namespace scarp {

namespace {

constexpr double picture_width = 720;  // px
constexpr double margin = 24;          // px
constexpr double tallest = 1200;       // px, of the surface
constexpr double headroom = 0.06;      // of the width, above and below the surface

constexpr double row_height = 22;   // px, of the legend
constexpr double letter_width = 8;  // px, at most on average
constexpr int path_decimals = 2;

// Colours that stay apart in print and for colour-blind readers (after Okabe and Ito 2008), for Si,
// polySi, SiO2, Si3N4, SiGe, polymer, mask and resist.
constexpr std::array<std::uint32_t, 8> fills{0xb8bec6, 0x8c6bb1, 0x5b9bd5, 0x4fb286,
                                             0xf0e442, 0xd55e00, 0xcc79a7, 0xe69f00};

// Of 256 steps each; hue in degrees, the others as parts.
std::array<std::uint8_t, 3> rgb_of_hsl(double hue, double saturation, double lightness) {
  const double amplitude = saturation * std::min(lightness, 1 - lightness);
  std::array<std::uint8_t, 3> rgb{};
  for (std::size_t n = 0; n < 3; ++n) {
    const double k = std::fmod((n == 0 ? 0 : n == 1 ? 8 : 4) + hue / 30, 12.0);
    const double value = lightness - amplitude * std::max(-1.0, std::min({k - 3, 9 - k, 1.0}));
    rgb[n] = static_cast<std::uint8_t>(std::lround(255 * value));
  }
  return rgb;
}

std::string fill_of(MaterialId material) {
  const auto [red, green, blue] = material_colour(material);
  return fmt::format("#{:02x}{:02x}{:02x}", red, green, blue);
}

struct Window {
  double left = 0;
  double right = 0;
  double bottom = 0;
  double top = 0;

  /// Pixels per nm: as wide as the picture, unless the surface is too tall for that.
  double scale() const {
    return std::min((picture_width - 2 * margin) / (right - left), tallest / (top - bottom));
  }
  double height() const { return (top - bottom) * scale() + 2 * margin; }
  double px(double x) const { return margin + (x - left) * scale(); }
  double py(double z) const { return margin + (top - z) * scale(); }
};

Window window_of(const ProfileView& view) {
  double lowest = 1e300;
  double highest = -1e300;
  const auto add = [&](std::span<const Polyline> lines) {
    for (const Polyline& line : lines) {
      for (const auto& [x, z] : line.points) {
        lowest = std::min(lowest, z);
        highest = std::max(highest, z);
      }
    }
  };
  for (const LayerProfile& layer : view.layers) add(layer.lines);
  for (const EarlierSurface& surface : view.earlier) add(surface.lines);
  if (lowest > highest) lowest = highest = 0;
  const double room = headroom * (view.right - view.left);
  return {view.left, view.right, lowest - room, highest + room};
}

using Pixel = std::array<double, 2>;

double squared_distance(const Pixel& a, const Pixel& b) {
  const double x = b[0] - a[0];
  const double y = b[1] - a[1];
  return x * x + y * y;
}

double squared_to_segment(const Pixel& p, const Pixel& a, const Pixel& b) {
  const double x = b[0] - a[0];
  const double y = b[1] - a[1];
  const double square = squared_distance(a, b);
  const double along =
      square > 0 ? std::clamp(((p[0] - a[0]) * x + (p[1] - a[1]) * y) / square, 0.0, 1.0) : 0;
  return squared_distance(p, {a[0] + along * x, a[1] + along * y});
}

// Without points that nobody sees: a straight wall needs its ends alone.
std::vector<Pixel> seen_points(const Polyline& line, const Window& window) {
  constexpr double unseen = 0.1 * 0.1;  // square pixels
  // However fine the grid is, a line has no more points than the picture can show.
  std::vector<Pixel> points;
  for (const auto& [x, z] : line.points) {
    const Pixel pixel{window.px(x), window.py(z)};
    if (points.empty() || squared_distance(points.back(), pixel) >= unseen) points.push_back(pixel);
  }
  const auto& [x, z] = line.points.back();
  points.push_back({window.px(x), window.py(z)});
  std::vector<Pixel> kept{points.front()};
  std::size_t last = 0;
  for (std::size_t n = 2; n < points.size(); ++n) {
    bool is_straight = true;
    for (std::size_t between = last + 1; between < n && is_straight; ++between)
      is_straight = squared_to_segment(points[between], points[last], points[n]) < unseen;
    if (is_straight) continue;
    last = n - 1;
    kept.push_back(points[last]);
  }
  kept.push_back(points.back());
  return kept;
}

// The region below a layer's surface as one even-odd path. A loop is closed by itself; any other
// line goes from side to side, or back to the same one, and is closed along the sides and the
// bottom: each point is then inside an odd number of outlines exactly if it is in the solid.
std::string path_of(const LayerProfile& layer, const Window& window) {
  std::string path;
  for (const Polyline& line : layer.lines) {
    if (line.points.empty()) continue;
    path += svg_line(seen_points(line, window), path_decimals);
    const auto& first = line.points.front();
    const auto& last = line.points.back();
    if (first != last) {
      const double floor = window.py(window.bottom);
      path += fmt::format("L{:.2f} {:.2f}L{:.2f} {:.2f}", window.px(last[0]), floor,
                          window.px(first[0]), floor);
    }
    path += 'Z';
  }
  return path;
}

std::string length_text(double nm) {
  return nm >= 1000 ? fmt::format("{:g} um", nm / 1000) : fmt::format("{:g} nm", nm);
}

// A layer that has been consumed lies on the one below, up to a trace: there is nothing to see of
// what covers less than a pixel.
std::vector<MaterialId> visible_materials(std::span<const LayerProfile> layers,
                                          const Window& window) {
  const double pixel = 1 / (window.scale() * window.scale());
  std::vector<MaterialId> seen;
  const LayerProfile* below = nullptr;
  for (const LayerProfile& layer : layers) {
    if (layer.lines.empty()) continue;
    const LayerProfile* const lower = std::exchange(below, &layer);
    if (lower != nullptr && area_above_zero(layer.lines) - area_above_zero(lower->lines) < pixel)
      continue;
    if (std::find(seen.begin(), seen.end(), layer.material) == seen.end()) {
      seen.push_back(layer.material);
    }
  }
  return seen;
}

// The bar that shows the scale, with its right end at the margin, and the room that it takes.
struct ScaleBar {
  std::string svg;
  double left = 0;  ///< px
};

ScaleBar scale_bar(const Window& window, double y) {
  const double length = rounded_down((window.right - window.left) / 5);
  const std::string label = length_text(length);
  const double end = picture_width - margin;
  const double begin = end - length * window.scale();
  return {
      .svg = fmt::format("<path d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"#222\" stroke-width=\"3\"/>",
                         begin, y + 7, end) +
             svg_text(begin - 8, y + 12, label, "end"),
      .left = begin - 8 - letter_width * static_cast<double>(label.size())};
}

struct Legend {
  std::string svg;
  double height = 0;  ///< px
};

// Names in rows that end before the scale bar.
Legend legend(const ProfileView& view, const Materials& materials, const Window& window, double y) {
  const ScaleBar bar = scale_bar(window, y);
  std::string svg = bar.svg;
  LegendRows rows(margin, bar.left, y, row_height);
  for (const MaterialId material : visible_materials(view.layers, window)) {
    const std::string& name = materials[material].name;
    const auto [left, top] = rows.place(40 + letter_width * static_cast<double>(name.size()));
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"14\" height=\"14\" fill=\"{}\"/>",
                       left, top, fill_of(material));
    svg += svg_text(left + 20, top + 12, name);
  }
  return {.svg = svg, .height = row_height + 8 + rows.more_height()};
}

// From blue to red over the times of the lines.
std::string colour_at(double time, const ProfileView& view) {
  const double first = view.earlier.front().time;
  const double last = view.earlier.back().time;
  const double part = last > first ? (time - first) / (last - first) : 0;
  return fmt::format("hsl({:.0f}, 85%, 38%)", 240 * (1 - part));
}

// Lines without an inside.
std::string stroke_of(std::span<const Polyline> lines, const std::string& colour,
                      const Window& window) {
  std::string path;
  for (const Polyline& line : lines) {
    std::vector<Pixel> points;
    for (const auto& [x, z] : line.points) points.push_back({window.px(x), window.py(z)});
    path += svg_line(points, path_decimals);
  }
  return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1\"/>\n", path,
                     colour);
}

// What the colours of the lines mean: the first and the last of them.
std::string times(const ProfileView& view, double y) {
  std::string svg;
  double x = margin;
  const double first = view.earlier.front().time;
  const double last = view.earlier.back().time;
  for (const double time : last > first ? std::vector{first, last} : std::vector{first}) {
    const std::string label = "t = " + plain_number(time, 4) + " s";
    svg += fmt::format("<path d=\"M{:.1f} {:.1f}h14\" stroke=\"{}\" stroke-width=\"2\"/>", x, y + 7,
                       colour_at(time, view));
    svg += svg_text(x + 20, y + 12, label);
    x += 40 + letter_width * static_cast<double>(label.size());
  }
  return svg;
}

}  // namespace

// Those without a colour of their own take turns of the golden angle around the circle of hues,
// which never come back to the same hue.
std::array<std::uint8_t, 3> material_colour(MaterialId material) {
  if (material < fills.size()) {
    const std::uint32_t fill = fills[material];
    return {static_cast<std::uint8_t>(fill >> 16), static_cast<std::uint8_t>(fill >> 8),
            static_cast<std::uint8_t>(fill)};
  }
  constexpr double golden_angle = 137.508;
  const double hue = std::fmod(golden_angle * static_cast<double>(material), 360.0);
  return rgb_of_hsl(hue, 0.4, material % 2 == 0 ? 0.45 : 0.68);
}

std::vector<EarlierSurface> some_of(std::span<const EarlierSurface> surfaces) {
  constexpr std::size_t most = 40;
  const std::size_t count = std::min(surfaces.size(), most);
  std::vector<EarlierSurface> some;
  for (std::size_t n = 0; n < count; ++n)
    some.push_back(surfaces[count > 1 ? n * (surfaces.size() - 1) / (count - 1) : 0]);
  return some;
}

void write_svg(const std::filesystem::path& file, const ProfileView& view,
               const Materials& materials) {
  const Window window = window_of(view);
  constexpr double title_height = 30;
  Legend names = legend(view, materials, window, title_height + window.height());
  if (!view.earlier.empty()) {
    names.svg += times(view, title_height + window.height() + names.height - 8);
    names.height += row_height;
  }
  const double height = title_height + window.height() + names.height;

  std::string svg = svg_text(margin, 22, view.title);
  svg += fmt::format("<g transform=\"translate(0 {})\">\n", title_height);
  // From the top of the stack down: each layer is the union of itself and those below, so the
  // lower ones are painted over the upper.
  for (auto layer = view.layers.rbegin(); layer != view.layers.rend(); ++layer) {
    if (layer->lines.empty()) continue;
    svg += fmt::format(
        "<path d=\"{}\" fill=\"{}\" fill-rule=\"evenodd\" stroke=\"#222\" stroke-width=\"0.6\"/>\n",
        path_of(*layer, window), fill_of(layer->material));
  }
  for (const EarlierSurface& surface : view.earlier)
    svg += stroke_of(surface.lines, colour_at(surface.time, view), window);
  svg += "</g>\n" + names.svg;
  write_file(file, svg_picture(picture_width, height, 14, svg));
}

}  // namespace scarp
