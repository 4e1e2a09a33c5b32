#include <scarp/simulation.h>

#include <cstdio>

constexpr const char* recipe = R"(
domain = { spacing = "20 nm", extent = ["1 um"], mode = "2d" }
geometry = [{ shape = "wafer", material = "Si" }, { shape = "trench", width = "400 nm", depth = "400 nm" }]
step = [{ model = "single_particle", material = "SiO2", growth_rate = "100 nm/min", sticking = 0.1, duration = "30 s" }]
)";

int main() {
  try {
    scarp::Simulation simulation({.text = recipe});
    simulation.run_to_end();
    const scarp::Metrology& metrology = simulation.metrology();
    for (const scarp::FilmMetrology& film : metrology.openings.at(0).films)
      if (film.step_coverage) std::printf("step coverage %.2f\n", *film.step_coverage);
  } catch (const scarp::InputError& error) {
    for (const scarp::Problem& problem : error.problems())
      std::printf("%s: %s; %s\n", problem.place.c_str(), problem.what.c_str(),
                  problem.remedy.c_str());
    return 2;
  }
}
