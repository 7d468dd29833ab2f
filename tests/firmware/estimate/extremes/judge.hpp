// What an answer is worth: every number finite, the wire takes it, and the truth lies within its bound.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "firmware/estimate/extremes/rig_renderer.hpp"

namespace lightwell::extremes {

/// All three settings, each at the default epsilon and at 0; neither smoothed nor mapped unless said.
[[nodiscard]] std::vector<EstimatorConfig> every_choice();
[[nodiscard]] EstimatorConfig choice(Setting setting, double epsilon);
[[nodiscard]] std::string name_of(const EstimatorConfig& config);

/// Ends the program where the rig or the configuration is refused: not what a row is about.
[[nodiscard]] std::unique_ptr<Estimator> estimator_of(const RigParameters& rig, const EstimatorConfig& config = {});

/// Every number but the bound's is finite, none of the bound's is NaN, directions are unit, every light has a track,
/// and what the encoder writes the decoder reads.
[[nodiscard]] bool sound(const Descriptor& d);

/// The larger of the two relative errors of irradiance.
[[nodiscard]] double error_of(const Descriptor& d, const std::vector<reference::V3>& normals,
                              const std::vector<reference::Rgb>& truth);
/// Largest difference of irradiance at any of the normals, of its RMS.
[[nodiscard]] double largest_difference(const Descriptor& a, const Descriptor& b,
                                        const std::vector<reference::V3>& normals);

/// A row's answers.
struct Tally {
  int answers = 0;
  int refused = 0;              ///< estimate() said that there is none.
  int flagged = 0;              ///< Any flag.
  int infinite = 0;             ///< No finite bound, for which a flag must stand.
  int unsound = 0;              ///< Not sound().
  int missed = 0;               ///< The error exceeds the finite bound.
  int silent = 0;               ///< Something is out of range, and the flag that says so is not there.
  double worst_error = 0;       ///< Of answers with a finite bound.
  double worst_over_bound = 0;  ///< Error by bound, of the same.
  std::string worst_case;       ///< Where that was.
  std::string unsound_case, silent_case;

  /// A bound may miss one frame in a hundred; a number that is not finite and a silent answer are lies at once.
  [[nodiscard]] int lies() const { return unsound + silent + std::max(0, missed - answers / 100); }
  [[nodiscard]] double flagged_share() const { return answers > 0 ? static_cast<double>(flagged) / answers : 0; }

  /// Of an answer whose truth is not known, or needs none. False where it is unsound.
  bool count(const Descriptor& d, const std::string& where);
  void count(const Descriptor& d, const std::vector<reference::V3>& normals, const std::vector<reference::Rgb>& truth,
             const std::string& where);
  void expect_flag(const Descriptor& d, Flag flag, const std::string& where);
  /// Nothing can be promised of the error: the bound must be infinite.
  void expect_no_bound(const Descriptor& d, const std::string& where);
  void add(const Tally& other);
};

}  // namespace lightwell::extremes
