#include "apps/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/atomic_file.h"

namespace scarp {

namespace {

constexpr double picture_width = 720;  // px
constexpr double margin = 24;          // px
constexpr double tallest = 1200;       // px, of the surface
constexpr double headroom = 0.06;      // of the width, above and below the surface

// Colours that stay apart in print and for colour-blind readers (after Okabe and Ito 2008), taken
// in the order in which materials come up from the bottom.
constexpr std::array<const char*, 8> fills{"#b8bec6", "#5b9bd5", "#e69f00", "#4fb286",
                                           "#cc79a7", "#f0e442", "#d55e00", "#8c6bb1"};

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
  for (const LayerProfile& layer : view.layers) {
    for (const Polyline& line : layer.lines) {
      for (const auto& [x, z] : line.points) {
        lowest = std::min(lowest, z);
        highest = std::max(highest, z);
      }
    }
  }
  if (lowest > highest) lowest = highest = 0;
  const double room = headroom * (view.right - view.left);
  return {view.left, view.right, lowest - room, highest + room};
}

// The region below a layer's surface as one even-odd path. A line from side to side is closed
// through the bottom, one that ends twice on the same side along that side, a loop by itself: each
// point is then inside an odd number of outlines exactly if it is in the solid.
std::string path_of(const LayerProfile& layer, const Window& window) {
  const double middle = 0.5 * (window.left + window.right);
  std::string path;
  for (const Polyline& line : layer.lines) {
    if (line.points.empty()) continue;
    char move = 'M';
    for (const auto& [x, z] : line.points) {
      path += fmt::format("{}{:.2f} {:.2f}", move, window.px(x), window.py(z));
      move = 'L';
    }
    const double first = line.points.front()[0];
    const double last = line.points.back()[0];
    if (line.points.front() != line.points.back() && (first < middle) != (last < middle)) {
      const double floor = window.py(window.bottom);
      path += fmt::format("L{:.2f} {:.2f}L{:.2f} {:.2f}", window.px(last), floor, window.px(first),
                          floor);
    }
    path += 'Z';
  }
  return path;
}

std::string length_text(double nm) {
  return nm >= 1000 ? fmt::format("{:g} um", nm / 1000) : fmt::format("{:g} nm", nm);
}

// The roundest length of about a fifth of the picture: 1, 2 or 5 times a power of ten.
double bar_length(double width) {
  const double wanted = width / 5;
  const double decade = std::pow(10.0, std::floor(std::log10(wanted)));
  const double mantissa = wanted / decade;
  return decade * (mantissa >= 5 ? 5 : mantissa >= 2 ? 2 : 1);
}

// Text as XML allows it: without the control characters that it has no way to write.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else {
      out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return out;
}

std::string legend(const ProfileView& view, const Materials& materials,
                   const std::vector<MaterialId>& order, double y) {
  std::string text;
  double x = margin;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::string& name = materials[order[i]].name;
    text += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"14\" height=\"14\" fill=\"{}\"/>"
        "<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        x, y, fills[i % fills.size()], x + 20, y + 12, escaped(name));
    x += 40 + 8.0 * static_cast<double>(name.size());
  }
  const Window window = window_of(view);
  const double bar = bar_length(window.right - window.left);
  const double end = picture_width - margin;
  text += fmt::format(
      "<path d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"#222\" stroke-width=\"3\"/>"
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
      end - bar * window.scale(), y + 7, end, end - bar * window.scale() - 8, y + 12,
      length_text(bar));
  return text;
}

}  // namespace

void write_svg(const std::filesystem::path& file, const ProfileView& view,
               const Materials& materials) {
  const Window window = window_of(view);
  std::vector<MaterialId> order;
  for (const LayerProfile& layer : view.layers) {
    if (std::find(order.begin(), order.end(), layer.material) == order.end()) {
      order.push_back(layer.material);
    }
  }
  constexpr double title_height = 30;
  constexpr double legend_height = 30;
  const double height = title_height + window.height() + legend_height;

  AtomicFile out(file);
  out.write(
      fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1:.0f}\" "
                  "viewBox=\"0 0 {0} {1:.0f}\" font-family=\"sans-serif\" font-size=\"14\" "
                  "fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
                  "<text x=\"{2}\" y=\"22\">{3}</text>\n<g transform=\"translate(0 {4})\">\n",
                  picture_width, height, margin, escaped(view.title), title_height));
  // From the top of the stack down: each layer is the union of itself and those below, so the
  // lower ones are painted over the upper.
  for (auto layer = view.layers.rbegin(); layer != view.layers.rend(); ++layer) {
    const auto colour = static_cast<std::size_t>(
        std::find(order.begin(), order.end(), layer->material) - order.begin());
    out.write(fmt::format(
        "<path d=\"{}\" fill=\"{}\" fill-rule=\"evenodd\" stroke=\"#222\" stroke-width=\"0.6\"/>\n",
        path_of(*layer, window), fills[colour % fills.size()]));
  }
  out.write("</g>\n");
  out.write(legend(view, materials, order, title_height + window.height()));
  out.write("</svg>\n");
  out.commit();
}

}  // namespace scarp
