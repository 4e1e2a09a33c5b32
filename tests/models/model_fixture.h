#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/recipe_table.h"
#include "models/registry.h"

namespace scarp {

/// The model of a step that is all right, on a wafer of Si and SiO2, or of other materials, 100 nm
/// wide.
inline StepModel read_step(const std::string& model, const std::string& keys,
                           bool two_dimensional = false,
                           const std::vector<std::string>& wafer = {"Si", "SiO2"}) {
  const RecipeFile file("[[step]]\n" + keys, "r.toml");
  const Materials materials;
  const Frame frame{
      .spacing = 10, .cells = {10, two_dimensional ? 1 : 10}, .two_dimensional = two_dimensional};
  std::vector<MaterialId> reachable;
  for (const std::string& name : wafer) reachable.push_back(materials.id(name));
  StepModel step =
      find_model(model)->read(file.root().tables("step")[0], {materials, reachable, ".", frame});
  file.finish();
  return step;
}

/// Points of some materials, all facing up unless said otherwise.
struct Points {
  std::vector<MaterialId> material;
  std::vector<Vec3f> normal;

  explicit Points(const std::vector<std::string>& names, std::vector<Vec3f> normals = {})
      : normal(std::move(normals)) {
    for (const std::string& name : names) material.push_back(Materials().id(name));
    normal.resize(material.size(), {0, 0, 1});
  }
  operator SurfacePoints() const { return {material, normal}; }
};

}  // namespace scarp
