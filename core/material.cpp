#include "core/material.h"

#include <array>

#include "core/error.h"
#include "core/suggestion.h"
#include "core/toml_text.h"

namespace scarp {

namespace {

/// Formula units from the mass density in g/cm^3 and the molar mass in g/mol, in 1e22 cm^-3.
constexpr double formula_units(double mass_density, double molar_mass) {
  constexpr double avogadro = 60.2214076;  // 1e22 / mol
  return mass_density * avogadro / molar_mass;
}

// Bare values are those that the published etch models were fitted with, so that their rates come
// out: Si, mask Belen et al. 2005 (a mask that all but withstands the etch); SiO2, Si3N4, polymer
// La Magna and Garozzo 2003; SiGe (x = 0.3) 5.02 - 0.60 x. Mass densities are those of the solid at
// room temperature in the CRC Handbook of Chemistry and Physics; deposited films are often less
// dense, and a recipe can say so. Resist is a novolac (C8H8O), aC amorphous carbon.
constexpr std::array<std::pair<const char*, double>, 31> built_in{{
    {"Si", 5.02},
    {"polySi", 5.02},
    {"SiO2", 2.2},
    {"Si3N4", 2.3},
    {"SiGe", 5.02 - 0.60 * 0.3},
    {"polymer", 2.0},
    {"mask", 500},
    {"resist", formula_units(1.2, 120.15)},
    {"aC", formula_units(2.0, 12.011)},
    {"Al", formula_units(2.70, 26.982)},
    {"Ti", formula_units(4.506, 47.867)},
    {"Cr", formula_units(7.15, 51.996)},
    {"Co", formula_units(8.86, 58.933)},
    {"Ni", formula_units(8.90, 58.693)},
    {"Cu", formula_units(8.96, 63.546)},
    {"Mo", formula_units(10.2, 95.95)},
    {"Ru", formula_units(12.1, 101.07)},
    {"Ta", formula_units(16.4, 180.948)},
    {"W", formula_units(19.3, 183.84)},
    {"Pt", formula_units(21.5, 195.084)},
    {"Au", formula_units(19.3, 196.967)},
    {"Ge", formula_units(5.323, 72.630)},
    {"GaAs", formula_units(5.318, 144.645)},
    {"GaN", formula_units(6.1, 83.730)},
    {"InP", formula_units(4.81, 145.792)},
    {"SiC", formula_units(3.16, 40.096)},
    {"TiN", formula_units(5.21, 61.874)},
    {"TaN", formula_units(13.7, 194.955)},
    {"Al2O3", formula_units(3.97, 101.961)},
    {"HfO2", formula_units(9.68, 210.49)},
    {"TiO2", formula_units(4.17, 79.866)},
}};

}  // namespace

Materials::Materials() {
  for (const auto& [name, density] : built_in) materials_.push_back({name, density});
}

std::vector<std::string> Materials::names() const {
  std::vector<std::string> names;
  for (const Material& material : materials_) names.push_back(material.name);
  return names;
}

std::optional<MaterialId> Materials::find(std::string_view name) const {
  for (std::size_t i = 0; i < materials_.size(); ++i) {
    if (materials_[i].name == name) return static_cast<MaterialId>(i);
  }
  return std::nullopt;
}

MaterialId Materials::id(std::string_view name) const {
  if (const auto found = find(name)) return *found;
  if (name.empty()) throw InputError("the name of the material is empty; write for example \"Si\"");
  throw InputError("there is no material " + in_quotes(name) + suggestion(name, names()) +
                   "; a recipe adds one with [materials." + toml_key(name) +
                   "] density = \"5e22 /cm3\"");
}

MaterialId Materials::add(Material material) {
  if (const auto old = find(material.name)) {
    materials_[*old] = std::move(material);
    return *old;
  }
  materials_.push_back(std::move(material));
  return static_cast<MaterialId>(materials_.size() - 1);
}

}  // namespace scarp
