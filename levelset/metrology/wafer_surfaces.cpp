#include "levelset/metrology/wafer_surfaces.h"

#include <algorithm>

#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

constexpr double least_above = 1e-3;  // spacings: less is where two layers have one surface

}  // namespace

WaferSurfaces::WaferSurfaces(const Layers& layers, std::span<const MaterialId> masks)
    : layers_(layers) {
  for (std::size_t n = 0; n < layers.stack.size(); ++n) {
    if (!adds_material(layers, n)) continue;
    meshes_.push_back(extract_surface(layers, n));
    present_.push_back(n);
  }
  for (const TriMesh& mesh : meshes_) {
    views_.emplace_back(mesh);
    slicers_.emplace_back(mesh);
  }
  structure_ = present_.size() - 1;
  for (std::size_t k = present_.size(); k-- > 1;) {
    if (std::ranges::find(masks, material(k)) == masks.end()) continue;
    if (!top_mask_) top_mask_ = k;
    structure_ = k - 1;
  }
}

std::vector<MaterialVolume> WaferSurfaces::volumes() const {
  const std::vector<double> each = material_volumes(meshes_, layers_.frame);
  std::vector<MaterialVolume> volumes;
  for (std::size_t n = 0; n < each.size(); ++n) {
    const MaterialId material = this->material(n);
    const auto same = std::ranges::find(volumes, material, &MaterialVolume::material);
    const MaterialVolume own{.material = material, .volume = each[n], .area = upper_area(n)};
    if (same == volumes.end()) {
      volumes.push_back(own);
    } else {
      same->volume += own.volume;
      same->area += own.area;
    }
  }
  return volumes;
}

double WaferSurfaces::upper_area(std::size_t n) const {
  const TriMesh& mesh = meshes_[n];
  const std::vector<double> areas = areas_around(mesh, layers_.frame);
  std::vector<double> own(mesh.vertices.size(), 1);
  if (n > 0) {
    const LevelSet& below = layers_.stack[n - 1].phi;
    std::ranges::transform(mesh.vertices, own.begin(), [&](const Vec3f& r) {
      return below.distance({r.x, r.y, r.z}) > least_above * layers_.frame.spacing ? 1 : 0;
    });
  }
  double sum = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (const std::uint32_t v : mesh.triangles[f]) sum += areas[f] * own[v] / 3;
  return sum;
}

}  // namespace scarp
