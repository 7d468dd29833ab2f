// How many lamps, where, and which of them distant: the fit that Schwarz's criterion takes, and those that it did not.
//   Sought, LampChooser
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "estimate/marker/light_choice.hpp"
#include "estimate/marker/light_fit.hpp"
#include "estimate/marker/light_search.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

struct Sought {
  Fit best;
  std::vector<Fit> others;  ///< What else was tried.
};

/// Of one frame, as one witness or both saw it. Refers to all that it is made of.
class LampChooser {
 public:
  LampChooser(const Observations& seen, const std::vector<Vec3d>& hull, const ChoiceOptions& options, Witness witness)
      : seen_(seen), hull_(hull), options_(options), witness_(witness) {}

  /// Lamps looked for everywhere.
  [[nodiscard]] Sought seek();
  /// The lamps of the frame before, from where they were. Nothing where one of them is gone, or where they do not
  /// explain this frame.
  [[nodiscard]] std::optional<Sought> follow(const ChosenLight& before);
  [[nodiscard]] LightSearch& search();

 private:
  [[nodiscard]] const Fit& best() const;
  /// Whether another lamp could pay for its parameters.
  [[nodiscard]] bool worth_more() const;
  void take(Fit fit);
  /// From these places, each lamp as near as it likes.
  void try_places(std::vector<Lamp> lamps);
  /// The best fit of so many lamps again with all of them, and each one, infinitely far: what a distance does not pay
  /// for is distant.
  void simplify(std::size_t count);
  void try_beside(std::vector<Lamp> lamps);

  const Observations& seen_;
  const std::vector<Vec3d>& hull_;
  const ChoiceOptions& options_;
  Witness witness_;
  std::optional<LightSearch> search_;
  std::vector<Fit> fits_;
  std::size_t best_ = 0;
};

}  // namespace lightwell::marker
