// Evaluation of descriptors: all values are valid, it can be encoded, and the true error is within its bound.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "firmware/estimate/extremes/rig_renderer.hpp"

namespace lightwell::extremes {

/// All three settings, each with the default epsilon and with 0.
[[nodiscard]] std::vector<EstimatorConfig> every_choice();
[[nodiscard]] EstimatorConfig choice(Setting setting, double epsilon);
[[nodiscard]] std::string name_of(const EstimatorConfig& config);

/// Creates an estimator. Exits with a message where the rig or the configuration is refused.
[[nodiscard]] std::unique_ptr<Estimator> estimator_of(const RigParameters& rig, const EstimatorConfig& config = {});

/// Whether all values except the bound's are finite, none of the bound's is NaN, directions are unit vectors, every
/// light has a track, and the encoded descriptor can be decoded.
[[nodiscard]] bool sound(const Descriptor& d);

/// The larger of the two relative RMS errors of irradiance (plain, luminance-weighted).
[[nodiscard]] double error_of(const Descriptor& d, const std::vector<reference::V3>& normals,
                              const std::vector<reference::Rgb>& truth);
/// Largest difference of irradiance over the normals, relative to its RMS.
[[nodiscard]] double largest_difference(const Descriptor& a, const Descriptor& b,
                                        const std::vector<reference::V3>& normals);

/// Statistics of the descriptors of a row. The names are those of the figures' keys.
struct Tally {
  int answers = 0;
  int refused = 0;              ///< estimate() failed.
  int flagged = 0;              ///< Any flag is set.
  int infinite = 0;             ///< No finite bound; a flag must state the reason.
  int unsound = 0;              ///< Not sound().
  int missed = 0;               ///< The error exceeds the finite bound.
  int silent = 0;               ///< A required flag or infinite bound is missing.
  double worst_error = 0;       ///< Of descriptors with a finite bound.
  double worst_over_bound = 0;  ///< Largest error / bound of these.
  std::string worst_case;       ///< Case of that ratio.
  std::string unsound_case, silent_case;

  /// Number of failures: all unsound and silent descriptors, and missed bounds beyond one in a hundred.
  [[nodiscard]] int lies() const { return unsound + silent + std::max(0, missed - answers / 100); }
  [[nodiscard]] double flagged_share() const { return answers > 0 ? static_cast<double>(flagged) / answers : 0; }

  /// Counts a descriptor without a truth. Returns false where it is unsound.
  bool count(const Descriptor& d, const std::string& where);
  void count(const Descriptor& d, const std::vector<reference::V3>& normals, const std::vector<reference::Rgb>& truth,
             const std::string& where);
  void expect_flag(const Descriptor& d, Flag flag, const std::string& where);
  /// Counts the descriptor as silent unless its bound is infinite.
  void expect_no_bound(const Descriptor& d, const std::string& where);
  void add(const Tally& other);
};

}  // namespace lightwell::extremes
