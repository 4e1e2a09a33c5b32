#include "apps/report/render.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "apps/report/cut_face.h"
#include "apps/run/picture.h"
#include "core/error.h"
#include "core/parallel.h"
#include "flux/rays/ray_scene.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/surface/extract_surface.h"
#include "levelset/surface/resample.h"

namespace scarp {

namespace {

constexpr int samples_per_side = 2;  // of a pixel
constexpr int samples_per_pixel = samples_per_side * samples_per_side;
constexpr int pixels_per_side = 2;  // of a tile, whose samples share what they see of the sky
constexpr int pixels_per_tile = pixels_per_side * pixels_per_side;
constexpr int samples_per_tile = pixels_per_tile * samples_per_pixel;
constexpr double depth_below = 0.08;  // of the block's width, below the lowest point

using Colour = Vec3d;  // linear in what is stored

constexpr Colour background{255, 255, 255};
constexpr Colour ink{40, 40, 40};

Colour colour_of(MaterialId material) {
  const Rgb rgb = material_colour(material);
  return {static_cast<double>(rgb[0]), static_cast<double>(rgb[1]), static_cast<double>(rgb[2])};
}

/// An axis-aligned block and where a line enters and leaves it.
struct Block {
  Vec3d lower;
  Vec3d upper;

  struct Passage {
    double enter = 0;
    double leave = 0;
    int axis = 2;  ///< of the face through which the line enters
  };

  std::optional<Passage> passage(const Vec3d& r, const Vec3d& u) const {
    Passage found{.enter = -1e300, .leave = 1e300};
    for (int axis = 0; axis < 3; ++axis) {
      if (u[axis] == 0) {
        if (r[axis] < lower[axis] || r[axis] > upper[axis]) return std::nullopt;
        continue;
      }
      const double a = (lower[axis] - r[axis]) / u[axis];
      const double b = (upper[axis] - r[axis]) / u[axis];
      if (std::min(a, b) > found.enter) {
        found.enter = std::min(a, b);
        found.axis = axis;
      }
      found.leave = std::min(found.leave, std::max(a, b));
    }
    return found.enter < found.leave ? std::optional(found) : std::nullopt;
  }
};

/// Directions of the picture.
struct Camera {
  Vec3d forward;
  Vec3d right;
  Vec3d up;

  Camera(double azimuth, double elevation) {
    constexpr double degree = std::numbers::pi / 180;
    const double a = azimuth * degree;
    const double e = elevation * degree;
    forward = {std::sin(a) * std::cos(e), std::cos(a) * std::cos(e), -std::sin(e)};
    right = {std::cos(a), -std::sin(a), 0};
    up = cross(right, forward);
  }
};

/// Numbers in [0, 1) that fill the unit square evenly (after Roberts 2018), shifted from tile to
/// tile.
std::array<double, 2> even_numbers(std::uint64_t tile, int n) {
  std::uint64_t hash = (tile + 1) * 0x9e3779b97f4a7c15U;
  hash = (hash ^ (hash >> 31)) * 0xbf58476d1ce4e5b9U;
  const auto fraction = [](double x) { return x - std::floor(x); };
  constexpr double to_unit = 0x1p-32;
  return {fraction(0.7548776662466927 * n + to_unit * static_cast<double>(hash & 0xffffffffU)),
          fraction(0.5698402909980532 * n + to_unit * static_cast<double>(hash >> 32))};
}

/// A direction by the cosine law about a normal.
Vec3d towards_sky(const Vec3d& n, const std::array<double, 2>& xi) {
  const Vec3d helper = std::abs(n.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
  const Vec3d a = normalized(cross(helper, n));
  const Vec3d b = cross(n, a);
  const double sine = std::sqrt(xi[0]);
  const double phi = 2 * std::numbers::pi * xi[1];
  return sine * std::cos(phi) * a + sine * std::sin(phi) * b + std::sqrt(1 - xi[0]) * n;
}

/// The pixels of the picture and the lines of sight through them. Rows of tiles are drawn one by
/// one: samples of a row lie tile by tile, in each pixel by pixel.
class Picture {
 public:
  struct Pixel {
    int row;
    int column;
  };

  /// As large as the block is seen. width: in pixels, unless the picture were too high for it.
  Picture(const Camera& camera, const Block& block, int width) : camera_(camera) {
    double low_x = 1e300;
    double high_x = -1e300;
    double low_y = 1e300;
    double high_y = -1e300;
    for (int corner = 0; corner < 8; ++corner) {
      Vec3d r;
      for (int axis = 0; axis < 3; ++axis)
        r[axis] = (corner >> axis & 1) != 0 ? block.upper[axis] : block.lower[axis];
      low_x = std::min(low_x, dot(r, camera.right));
      high_x = std::max(high_x, dot(r, camera.right));
      low_y = std::min(low_y, dot(r, camera.up));
      high_y = std::max(high_y, dot(r, camera.up));
    }
    constexpr double margin = 0.03;  // of the width
    constexpr int most_height = 2;   // times the width
    const double wide = (1 + 2 * margin) * (high_x - low_x);
    const double high = high_y - low_y + 2 * margin * (high_x - low_x);
    pixel_ = std::max(wide, high / most_height) / width;
    width_ = static_cast<int>(std::ceil(wide / pixel_ - 1e-9));
    height_ = static_cast<int>(std::ceil(high / pixel_ - 1e-9));
    left_ = 0.5 * (low_x + high_x) - 0.5 * pixel_ * width_;
    top_ = 0.5 * (low_y + high_y) + 0.5 * pixel_ * height_;
  }

  int width() const { return width_; }
  int height() const { return height_; }
  double pixel() const { return pixel_; }  ///< nm
  const Vec3d& forward() const { return camera_.forward; }

  int tile_rows() const { return (height_ + pixels_per_side - 1) / pixels_per_side; }
  std::size_t samples_per_row() const {
    const int tiles = (width_ + pixels_per_side - 1) / pixels_per_side;
    return static_cast<std::size_t>(tiles) * samples_per_tile;
  }
  bool holds(const Pixel& pixel) const { return pixel.row < height_ && pixel.column < width_; }

  static Pixel pixel_of(int tile_row, std::size_t sample) {
    const auto tile = static_cast<int>(sample / samples_per_tile);
    const auto n = static_cast<int>(sample % samples_per_tile) / samples_per_pixel;
    return {.row = pixels_per_side * tile_row + n / pixels_per_side,
            .column = pixels_per_side * tile + n % pixels_per_side};
  }

  /// A point of the line of sight.
  Vec3d place_of(int tile_row, std::size_t sample) const {
    const auto [row, column] = pixel_of(tile_row, sample);
    const std::size_t n = sample % samples_per_pixel;
    const auto offset = [](std::size_t k) {
      return (static_cast<double>(k) + 0.5) / samples_per_side;
    };
    const double x = column + offset(n % samples_per_side);
    const double y = row + offset(n / samples_per_side);
    return (left_ + x * pixel_) * camera_.right + (top_ - y * pixel_) * camera_.up;
  }

 private:
  Camera camera_;
  int width_ = 0;
  int height_ = 0;
  double pixel_ = 0;
  double left_ = 0;
  double top_ = 0;
};

/// A place on a side or a cut of the block.
struct FacePoint {
  Colour colour;
  Vec3d r;
  int axis;
  double clearance;  ///< to the next line

  /// Whether another one looks the same for sure.
  bool reaches(const Vec3d& other, int its_axis) const {
    return axis == its_axis && length(other - r) < clearance;
  }
};

/// The sides and the cut of the block: materials within, their borders as lines.
class Faces {
 public:
  /// Of a block as the camera sees it. line: half the width of a border; nm.
  Faces(const Layers& layers, const Block& block, const Camera& camera, double line) {
    const std::vector<TriMesh> surfaces = layer_surfaces(layers);
    for (const int axis : {0, 1}) {
      const double position = camera.forward[axis] > 0 ? block.lower[axis] : block.upper[axis];
      faces_.emplace_back(layers, surfaces, axis, position, line);
    }
  }

  /// Nothing in the gas.
  std::optional<FacePoint> face_point(const Vec3d& r, int axis) const {
    const FacePlace place = faces_[static_cast<std::size_t>(axis)].at(r[1 - axis], r.z);
    if (!place.material) return std::nullopt;
    return FacePoint{.colour = place.clearance < 0 ? ink : on_face(axis, *place.material),
                     .r = r,
                     .axis = axis,
                     .clearance = place.clearance};
  }

 private:
  static Colour on_face(int axis, MaterialId material) {
    return (axis == 1 ? 1.0 : 0.82) * colour_of(material);
  }

  std::vector<CutFace> faces_;  ///< across x and across y
};

/// Which facets touch one of another material.
std::vector<char> facets_at_borders(const TriMesh& surface) {
  constexpr MaterialId none = static_cast<MaterialId>(-1);
  constexpr MaterialId several = static_cast<MaterialId>(-2);
  std::vector<MaterialId> at_vertex(surface.vertices.size(), none);
  for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
    for (const std::uint32_t v : surface.triangles[f]) {
      const bool is_same = at_vertex[v] == none || at_vertex[v] == surface.materials[f];
      at_vertex[v] = is_same ? surface.materials[f] : several;
    }
  }
  std::vector<char> at_border;
  at_border.reserve(surface.triangles.size());
  for (const Triangle& corners : surface.triangles)
    at_border.push_back(
        std::ranges::any_of(corners, [&](std::uint32_t v) { return at_vertex[v] == several; }));
  return at_border;
}

/// The surface as rays meet it, in units of the grid about an origin.
struct ShadedScene {
  const Layers& layers;
  const TriMesh& surface;
  RayScene rays;
  Vec3d origin;
  std::vector<char> at_border = facets_at_borders(surface);

  Vec3d in_scene(const Vec3d& r) const { return (r - origin) / layers.frame.spacing; }
  Vec3d in_layers(const Vec3d& r) const { return origin + layers.frame.spacing * r; }

  /// What is behind the sides of the domain is not seen, though flights come back from there.
  bool meets_surface(const Ray& ray, const Flight& flight, double length) const {
    if (flight.end != Flight::End::front) return false;
    const Vec3d way = flight.r - ray.r;
    const double along = dot(way, ray.u);
    const bool is_straight = flight.u == ray.u && scarp::length(way - along * ray.u) < 1e-3;
    return is_straight && along * layers.frame.spacing <= length * (1 + 1e-6);
  }

  /// Of the facet, and where materials meet of the lowest layer whose surface is there: by facets
  /// borders have teeth.
  MaterialId material(const Flight& flight) const {
    if (at_border[flight.facet] == 0) return surface.materials[flight.facet];
    const Vec3d r = in_layers(flight.r);
    const double there = layers.top().distance(r) + 0.25 * layers.frame.spacing;
    const auto reaches = [&](const Layer& layer) { return layer.phi.distance(r) <= there; };
    return std::ranges::find_if(layers.stack, reaches)->material;
  }

  /// That of phi where it agrees with the facet: smooth on curved walls, sharp at edges.
  Vec3d smooth_normal(const Flight& flight) const {
    const Vec3d n = rays.normal(flight.facet);
    const Vec3d smooth = layers.top().normal(in_layers(flight.r));
    return dot(smooth, n) > 0.9 ? smooth : n;
  }
};

/// Colours of the surface: by material, by how much of the sky is seen, and by a light.
class Shading {
 public:
  Shading(const ShadedScene& scene, int sky_rays) : scene_(scene), sky_rays_(sky_rays) {}

  /// Shape: flights that arrived on the surface, by the samples of the row of tiles that see them.
  void shade(int tile_row, std::span<const std::size_t> samples, std::span<const Flight> there,
             std::vector<Colour>& seen) const {
    const std::vector<int> open = rays_to_sky(tile_row, samples, there);
    const auto tile_of = [&](std::size_t k) { return samples[k] / samples_per_tile; };
    for (std::size_t first = 0, end = 0; first < there.size(); first = end) {
      while (end < there.size() && tile_of(end) == tile_of(first)) ++end;
      const std::size_t count = end - first;
      shade_tile(samples.subspan(first, count), there.subspan(first, count),
                 std::span(open).subspan(first, count), seen);
    }
  }

 private:
  /// open: of the rays to the sky from each place.
  void shade_tile(std::span<const std::size_t> samples, std::span<const Flight> there,
                  std::span<const int> open, std::vector<Colour>& seen) const {
    const Vec3d light = normalized(Vec3d{-0.5, -0.4, 1});
    Vec3d normal{};
    for (std::size_t k = 0; k < there.size(); ++k) {
      // A pixel is small: the samples of it that see the same facet share a normal.
      const bool goes_on = k > 0 && there[k].facet == there[k - 1].facet &&
                           samples[k] / samples_per_pixel == samples[k - 1] / samples_per_pixel;
      if (!goes_on) normal = scene_.smooth_normal(there[k]);
      const double lit = std::max(0.0, dot(normal, light));
      seen[samples[k]] = (0.22 + 0.43 * share_of_sky(there[k], there, open) + 0.35 * lit) *
                         colour_of(scene_.material(there[k]));
    }
  }

  /// How many of the rays from each place meet nothing. The samples of a tile share out one set of
  /// directions.
  std::vector<int> rays_to_sky(int tile_row, std::span<const std::size_t> samples,
                               std::span<const Flight> there) const {
    const auto sky_rays = static_cast<std::size_t>(sky_rays_);
    std::vector<Ray> rays;
    rays.reserve(there.size() * sky_rays);
    for (std::size_t k = 0; k < there.size(); ++k) {
      const Vec3d n = scene_.rays.normal(there[k].facet);
      const std::uint64_t tile =
          (static_cast<std::uint64_t>(tile_row) << 32) + samples[k] / samples_per_tile;
      const int first = static_cast<int>(samples[k] % samples_per_tile) * sky_rays_;
      for (int m = first; m < first + sky_rays_; ++m) {
        rays.push_back(
            {.r = there[k].r, .u = towards_sky(n, even_numbers(tile, m)), .from = there[k].facet});
      }
    }
    std::vector<Flight> flights(rays.size());
    scene_.rays.fly(rays, flights);
    std::vector<int> open(there.size());
    for (std::size_t k = 0; k < flights.size(); ++k)
      open[k / sky_rays] += static_cast<int>(flights[k].end == Flight::End::sky);
    return open;
  }

  /// By the rays from all places of a tile that face about the same way as one of them.
  double share_of_sky(const Flight& from, std::span<const Flight> there,
                      std::span<const int> open) const {
    const Vec3d n = scene_.rays.normal(from.facet);
    int rays = 0;
    int to_sky = 0;
    for (std::size_t k = 0; k < there.size(); ++k) {
      if (dot(scene_.rays.normal(there[k].facet), n) < 0.9) continue;
      rays += sky_rays_;
      to_sky += open[k];
    }
    return static_cast<double>(to_sky) / rays;
  }

  const ShadedScene& scene_;
  int sky_rays_;
};

/// The part of the wafer that is shown: between the sides, and beyond the cut.
Block block_of(const Layers& layers, const TriMesh& surface, const std::optional<RenderCut>& cut) {
  const Sides sides = layers.frame.sides();
  const Box box = bounding_box(surface);
  const double wide = std::max(sides.width(0), sides.width(1));
  Block block{.lower = {sides.lower[0], sides.lower[1], box.lower.z - depth_below * wide},
              .upper = {sides.upper[0], sides.upper[1], box.upper.z + 0.5 * layers.frame.spacing}};
  if (cut) block.lower[cut->axis] = cut->position;
  return block;
}

/// Where RayScene has its origin.
Vec3d origin_of(const Layers& layers, const TriMesh& surface) {
  const Sides sides = layers.frame.sides();
  const Box box = bounding_box(surface);
  return {sides.lower[0], sides.lower[1], 0.5 * (box.lower.z + box.upper.z)};
}

/// Follows the lines of sight, row of tiles by row of tiles.
class Renderer {
 public:
  Renderer(const Layers& layers, const TriMesh& surface, const RenderOptions& options)
      : scene_{.layers = layers,
               .surface = surface,
               .rays = {surface, layers.frame.sides(), layers.frame.spacing},
               .origin = origin_of(layers, surface)},
        block_(block_of(layers, surface, options.cut)),
        picture_(Camera(options.azimuth, options.elevation), block_, options.width),
        faces_(layers, block_, Camera(options.azimuth, options.elevation), 0.8 * picture_.pixel()),
        shading_(scene_, options.sky_rays) {}

  Image run() const {
    Image image{.width = picture_.width(), .height = picture_.height(), .pixels = {}};
    image.pixels.resize(static_cast<std::size_t>(image.width) *
                        static_cast<std::size_t>(image.height));
    const auto rows = static_cast<std::size_t>(picture_.tile_rows());
    parallel_for(rows, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) draw_tiles(static_cast<int>(row), image);
    });
    return image;
  }

 private:
  /// What a line of sight meets between where it enters the block and leaves it.
  struct Sight {
    std::size_t sample;  ///< of its row of tiles
    Vec3d entry;
    Vec3d exit;
    int axis = 2;  ///< of the face through which it enters
  };

  void draw_tiles(int tile_row, Image& image) const {
    std::vector<Colour> seen(picture_.samples_per_row(), background);
    look(tile_row, seen);
    for (std::size_t first = 0; first < seen.size(); first += samples_per_pixel) {
      const Picture::Pixel at = Picture::pixel_of(tile_row, first);
      if (!picture_.holds(at)) continue;
      Colour sum{};
      for (const Colour& sample : std::span(seen).subspan(first, samples_per_pixel)) sum += sample;
      const Colour mean = sum / samples_per_pixel;
      Rgb& pixel =
          image.pixels[static_cast<std::size_t>(at.row) * static_cast<std::size_t>(image.width) +
                       static_cast<std::size_t>(at.column)];
      for (int c = 0; c < 3; ++c)
        pixel[static_cast<std::size_t>(c)] =
            static_cast<std::uint8_t>(std::lround(std::clamp(mean[c], 0.0, 255.0)));
    }
  }

  void look(int tile_row, std::vector<Colour>& seen) const {
    const std::vector<Sight> sights = sights_beyond_faces(tile_row, seen);
    std::vector<Ray> rays;
    rays.reserve(sights.size());
    for (const Sight& sight : sights)
      rays.push_back({.r = scene_.in_scene(sight.entry), .u = picture_.forward()});
    std::vector<Flight> flights(rays.size());
    scene_.rays.fly(rays, flights);
    std::vector<std::size_t> lit;
    std::vector<Flight> there;
    for (std::size_t k = 0; k < sights.size(); ++k) {
      const Sight& sight = sights[k];
      if (scene_.meets_surface(rays[k], flights[k], length(sight.exit - sight.entry))) {
        lit.push_back(sight.sample);
        there.push_back(flights[k]);
      } else if (sight.axis != 2 && scene_.layers.top().distance(sight.exit) < 0) {
        // Rounding: the line passes between a facet and its cut, and went through solid all the
        // way.
        seen[sight.sample] = ink;
      }
    }
    shading_.shade(tile_row, lit, there, seen);
  }

  /// Those that no face of the block ends; colours the samples of the others.
  std::vector<Sight> sights_beyond_faces(int tile_row, std::vector<Colour>& seen) const {
    std::vector<Sight> sights;
    std::optional<FacePoint> last;
    for (std::size_t sample = 0; sample < seen.size(); ++sample) {
      const Vec3d r = picture_.place_of(tile_row, sample);
      const auto passage = block_.passage(r, picture_.forward());
      if (!passage) continue;
      const Vec3d entry = r + passage->enter * picture_.forward();
      if (passage->axis != 2) {
        if (!last || !last->reaches(entry, passage->axis))
          last = faces_.face_point(entry, passage->axis);
        if (last) {
          seen[sample] = last->colour;
          continue;
        }
      }
      const Vec3d exit = r + passage->leave * picture_.forward();
      sights.push_back({.sample = sample, .entry = entry, .exit = exit, .axis = passage->axis});
    }
    return sights;
  }

  ShadedScene scene_;
  Block block_;
  Picture picture_;
  Faces faces_;
  Shading shading_;
};

/// Of a wafer that is the same around an axis, from side to side: finer is not seen in a picture.
constexpr int most_cells_around_axis = 240;

}  // namespace

Image render(const Layers& layers, const RenderOptions& options) {
  if (layers.frame.is_around_axis())
    return render(revolved(layers, most_cells_around_axis), options);
  if (layers.frame.is_section()) {
    throw InputError("a cross-section has no depth to render; draw it with scarp section");
  }
  const TriMesh surface = extract_surface(layers);
  return Renderer(layers, surface, options).run();
}

}  // namespace scarp
