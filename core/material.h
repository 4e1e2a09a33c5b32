// A public header: installed as scarp/core/material.h.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scarp {

/// Index into a Materials table.
using MaterialId = std::uint16_t;

/// Units: density in 1e22 atoms or formula units per cm^3; 0 when it is not known.
struct Material {
  std::string name;
  double density = 0;
};

/// The materials of one run: those built in, and those a recipe adds.
class Materials {
 public:
  /// Starts with the built-in table (Si, SiO2, Si3N4, ...; sources in material.cpp).
  Materials();

  const Material& operator[](MaterialId id) const { return materials_[id]; }
  std::size_t size() const { return materials_.size(); }
  std::vector<std::string> names() const;

  /// Throws InputError that suggests the nearest name if there is none of that name.
  MaterialId id(std::string_view name) const;
  std::optional<MaterialId> find(std::string_view name) const;
  bool contains(std::string_view name) const { return find(name).has_value(); }

  /// Adds a material, or replaces the density of one that is there.
  MaterialId add(Material material);

 private:
  std::vector<Material> materials_;
};

}  // namespace scarp
