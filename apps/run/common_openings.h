#pragma once

#include <map>
#include <vector>

#include "core/frame.h"
#include "levelset/metrology/metrology.h"

namespace scarp {

/// Where an opening lies. Units: nm.
struct OpeningPlace {
  int number = 0;
  bool is_trench = false;
  std::array<double, 2> centre{};
  std::array<double, 2> width{};
};

OpeningPlace place_of(const OpeningMetrology& opening);

/// Whether the middle of one of two openings lies in the box around the other one, as where one has
/// merged with more.
bool overlap(const OpeningPlace& a, const OpeningPlace& b, const Frame& frame);

/// Whether two openings may be one: their middles are a quarter of the smaller width apart, or two
/// spacings.
bool are_at_one_place(const OpeningPlace& a, const OpeningPlace& b, const Frame& frame);

/// The numbers of openings of several runs, by place: those of the first run that has them.
class CommonOpenings {
 public:
  /// Gives the openings of a run common numbers.
  ///
  /// Shape: taken has those that the run's own numbers have already, and gets the new ones.
  void rename(std::vector<OpeningMetrology>& openings, std::map<int, int>& taken,
              const Frame& frame);

 private:
  int number_of(const OpeningMetrology& opening, const std::map<int, int>& taken,
                const Frame& frame);

  std::vector<OpeningPlace> known_;
};

}  // namespace scarp
