#include "import_checks.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "calibration/model/camera_model.hpp"

namespace lightwell::test {

void expect_same_pixels(const LensParameters& lens, const Formula& formula) {
  const CameraModel model(lens);
  EXPECT_DOUBLE_EQ(model.max_angle_rad(), lens.max_angle_rad) << "the model's domain ends inside the field of view";
  constexpr int kThetas = 200, kPhis = 64;
  double largest = 0;
  for (int i = 0; i <= kThetas; ++i) {
    for (int j = 0; j < kPhis; ++j) {
      const double theta = lens.max_angle_rad * i / kThetas, phi = 2 * std::numbers::pi * j / kPhis;
      // Not of unit length.
      const Vec3d p = Vec3d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)} * 2.5;
      const auto ours = model.project(p);
      ASSERT_TRUE(ours) << theta << " " << phi;
      const Pixel theirs = formula(p.x, p.y, p.z);
      largest = std::max(largest, std::hypot(ours->x - theirs[0], ours->y - theirs[1]));
    }
  }
  EXPECT_LT(largest, 1e-6) << "pixels, of " << kThetas * kPhis << " directions";
}

ImportedCalibration imported(const std::string& text, const ImportOptions& options) {
  Result<ImportedCalibration> result = import_calibration(text, "given", options);
  if (result) return *result;
  ADD_FAILURE() << result.status().message();
  ImportedCalibration empty;
  empty.rig.lenses.resize(2);
  return empty;
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == std::string::npos) {
    ADD_FAILURE() << "'" << from << "' is not in the text";
    return text;
  }
  return text.replace(at, from.size(), to);
}

void expect_refused(const std::string& text, const std::vector<std::string>& parts, const ImportOptions& options) {
  const Result<ImportedCalibration> result = import_calibration(text, "given", options);
  ASSERT_FALSE(result) << "was imported; expected error: " << (parts.empty() ? "" : parts.front());
  for (const std::string& part : parts)
    EXPECT_NE(result.status().message().find(part), std::string::npos)
        << "'" << part << "' is not in: " << result.status().message();
}

bool noted(const ImportedCalibration& imported, const std::string& part) {
  for (const std::string& note : imported.notes)
    if (note.find(part) != std::string::npos) return true;
  return false;
}

}  // namespace lightwell::test
