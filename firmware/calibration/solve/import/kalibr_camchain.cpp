// Reads Kalibr's camchain YAML. Parameters and their order: github.com/ethz-asl/kalibr/wiki/yaml-formats and
// supported-models.
#include <algorithm>
#include <array>
#include <cmath>

#include <lightwell/text.hpp>

#include "calibration/solve/import/yaml_map.hpp"

namespace lightwell {

namespace {

/// The numbers N of all "camN", ascending.
std::vector<int> camera_numbers(const YamlMap& chain) {
  std::vector<int> out;
  for (const std::string& key : chain.keys()) {
    if (!key.starts_with("cam")) continue;
    const auto n = parse_number<int>(std::string_view(key).substr(3));
    if (n && *n >= 0) out.push_back(*n);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::string name_of(int camera) { return "cam" + std::to_string(camera); }

/// A list of `count` finite numbers.
std::vector<double> exactly(const YamlMap& camera, const std::string& key, std::size_t count,
                            const std::string& order) {
  const std::vector<double> values = camera.numbers(key);
  if (values.size() != count)
    camera.refuse(
        key, "must be " + std::to_string(count) + " numbers, " + order + "; it has " + std::to_string(values.size()));
  check_numbers(camera, key, values);
  return values;
}

/// A camera model of Kalibr's: its intrinsics, of which fu fv pu pv are the last, and its models of distortion.
struct KalibrModel {
  std::string name;
  std::size_t intrinsics;
  std::string order;
  std::vector<std::string> distortions;
};

const std::array<KalibrModel, 4> kModels{{
    {"pinhole", 4, "fu fv pu pv", {"equidistant", "radtan", "none"}},
    {"ds", 6, "xi alpha fu fv pu pv", {"none"}},
    {"omni", 5, "xi fu fv pu pv", {"radtan", "none"}},
    {"eucm", 6, "alpha beta fu fv pu pv", {"none"}},
}};

/// Four coefficients of `distortion`; zeros for none.
std::vector<double> distortion_coefficients(const YamlMap& camera, const std::string& distortion) {
  static constexpr const char* kKey = "distortion_coeffs";
  if (distortion != "none")
    return exactly(camera, kKey, 4, distortion == "equidistant" ? "k1 k2 k3 k4" : "k1 k2 r1 r2");
  if (camera.has(kKey) && !camera.numbers(kKey).empty())
    camera.refuse(kKey, "distortion_model none has no coefficients; say which model they are of");
  return std::vector<double>(4, 0.0);
}

ModelParameters model_of(const YamlMap& camera, const KalibrModel& model, const std::string& distortion) {
  if (model.name == "pinhole" && distortion == "fov")
    camera.refuse("distortion_model",
                  no_exact_model("the FOV model (Devernay & Faugeras 2001)", "its radius is an arctangent"));
  if (std::ranges::find(model.distortions, distortion) == model.distortions.end())
    camera.refuse("distortion_model",
                  "'" + distortion + "' is unknown for " + model.name + "; known: " + joined(model.distortions));
  const std::vector<double> v = exactly(camera, "intrinsics", model.intrinsics, model.order);
  const std::size_t n = v.size();
  const PinholeFields p{v[n - 4], v[n - 3], v[n - 2], v[n - 1]};
  check_pinhole(camera, "intrinsics", p);
  const std::vector<double> d = distortion_coefficients(camera, distortion);

  if (distortion == "equidistant") return kannala_brandt_of(p, d);
  // unified_lens() has a value for four coefficients.
  if (model.name == "pinhole") return *unified_lens(p, 0, d);
  if (model.name == "omni") {
    if (!(v[0] >= 0))
      camera.refuse("intrinsics",
                    "xi must be zero or more, it is " + listed(std::array{v[0]}) + "; the order is " + model.order);
    return *unified_lens(p, v[0], d);
  }
  if (model.name == "ds") {
    if (!(v[0] > -1 && v[0] < 1) || !(v[1] >= 0 && v[1] <= 1))
      camera.refuse("intrinsics", "xi must lie between -1 and 1 and alpha from 0 to 1, they are " +
                                      listed(std::array{v[0], v[1]}) + "; the order is " + model.order);
    return DoubleSphereParameters{p.fx, p.fy, p.cx, p.cy, v[0], v[1]};
  }
  // eucm: Khomutenko et al. 2016, eq. 2 to 4: denominator alpha rho + (1 - alpha) z, rho² = beta (x² + y²) + z². With
  // beta = 1 it is equal to the double sphere model with xi = 0.
  if (!(v[0] >= 0 && v[0] <= 1)) camera.refuse("intrinsics", "alpha must be 0 to 1; the order is " + model.order);
  if (v[1] != 1)
    camera.refuse("camera_model", no_exact_model("eucm", "its surface is an ellipsoid, beta " +
                                                             listed(std::array{v[1]}) + " instead of 1"));
  return DoubleSphereParameters{p.fx, p.fy, p.cx, p.cy, 0, v[0]};
}

ImportedCamera read_camera(const YamlMap& camera, const std::string& name) {
  const std::vector<double> size = exactly(camera, "resolution", 2, "width and height");
  check_size(camera, "resolution", size[0], size[1]);
  const std::string word = camera.word("camera_model");
  // Kalibr's examples of models without distortion omit the field.
  const std::string distortion = camera.has("distortion_model") ? camera.word("distortion_model") : "none";
  const auto model = std::ranges::find(kModels, word, &KalibrModel::name);
  if (model == kModels.end())
    camera.refuse("camera_model", "'" + word +
                                      "' is unknown; known are pinhole (with equidistant; radtan and none), ds, omni "
                                      "(radtan or none), eucm");
  return {name, static_cast<int>(size[0]), static_cast<int>(size[1]), model_of(camera, *model, distortion),
          distortion != "equidistant"};
}

void note_timeshift(const YamlMap& camera, const std::string& name, std::vector<std::string>& notes) {
  static constexpr const char* kKey = "timeshift_cam_imu";
  if (!camera.has(kKey)) return;
  const std::array shift{camera.number(kKey)};
  check_numbers(camera, kKey, shift);
  notes.push_back(name + ": timeshift_cam_imu " + listed(shift) +
                  " s (t_imu = t_cam + shift) is ignored, because a rig has no IMU");
}

/// Shepperd 1978: divides by the largest of the four components, which is well away from zero.
Quat quaternion_of(const std::array<Vec3d, 3>& m) {
  const double x = m[0].x, y = m[1].y, z = m[2].z, trace = x + y + z;
  Quat q;
  if (trace >= x && trace >= y && trace >= z)
    q = {m[2].y - m[1].z, m[0].z - m[2].x, m[1].x - m[0].y, 1 + trace};
  else if (x >= y && x >= z)
    q = {1 + x - y - z, m[0].y + m[1].x, m[0].z + m[2].x, m[2].y - m[1].z};
  else if (y >= z)
    q = {m[0].y + m[1].x, 1 - x + y - z, m[1].z + m[2].y, m[0].z - m[2].x};
  else
    q = {m[0].z + m[2].x, m[1].z + m[2].y, 1 - x - y + z, m[1].x - m[0].y};
  return q.normalized();
}

/// T_cn_cnm1, a 4 x 4 homogeneous matrix.
Pose chain_pose(const YamlMap& camera) {
  // Tolerance of orthonormality: files have at least seven digits.
  constexpr double kOrthonormal = 1e-4;
  static constexpr const char* kKey = "T_cn_cnm1";
  const std::vector<std::vector<double>> rows = camera.rows(
      camera.require({kKey},
                     ", so the relative pose of the two lenses is unknown; calibrate both together, or import one with "
                     "--camera"));
  if (rows.size() != 4) camera.refuse(kKey, "must be 4 x 4 numbers, it has " + std::to_string(rows.size()) + " rows");
  for (const auto& row : rows) {
    if (row.size() != 4) camera.refuse(kKey, "must be 4 x 4 numbers, a row has " + std::to_string(row.size()));
    check_numbers(camera, kKey, row);
  }
  if (rows[3] != std::vector<double>{0, 0, 0, 1}) camera.refuse(kKey, "the last row must be 0 0 0 1");
  std::array<Vec3d, 3> m;
  for (std::size_t i = 0; i < 3; ++i) m[i] = {rows[i][0], rows[i][1], rows[i][2]};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j)
      if (!(std::abs(dot(m[i], m[j]) - (i == j ? 1 : 0)) < kOrthonormal))
        camera.refuse(kKey, "is no rotation: its rows are not unit vectors at right angles");
  if (dot(m[0], cross(m[1], m[2])) < 0) camera.refuse(kKey, "mirrors: its determinant is -1");
  return {quaternion_of(m), {rows[0][3], rows[1][3], rows[2][3]}};
}

}  // namespace

std::optional<ImportKind> resembled_kind(std::string_view text, const std::string& name) {
  const YamlMap map = YamlMap::parse(text, name);
  const bool kalibr = !camera_numbers(map).empty();
  const bool ros = map.has("distortion_model") || (map.has("camera_matrix") && map.has("distortion_coefficients"));
  if (kalibr == ros) return std::nullopt;
  return kalibr ? ImportKind::kalibr : ImportKind::ros;
}

ImportedCameras read_kalibr_camchain(std::string_view text, const std::string& name, std::optional<int> camera) {
  const YamlMap chain = YamlMap::parse(text, name);
  std::vector<int> numbers = camera_numbers(chain);
  std::string names;
  for (const int n : numbers) names += (names.empty() ? "" : ", ") + name_of(n);
  if (numbers.empty())
    throw ImportError(name + ": no cam0: not a camchain of Kalibr's; its cameras stand at the outermost level");
  if (camera) {
    if (std::find(numbers.begin(), numbers.end(), *camera) == numbers.end())
      throw ImportError(name + ": no " + name_of(*camera) + "; there is " + names);
    numbers = {*camera};
  }
  if (numbers.size() > 2)
    throw ImportError(
        name + ": " + std::to_string(numbers.size()) + " cameras (" + names +
        "), a rig has one or two lenses; choose one with --camera, or write two of them into a file of their own");
  if (numbers.size() == 2 && numbers[1] != numbers[0] + 1)
    throw ImportError(name + ": " + names +
                      " are not consecutive, but T_cn_cnm1 is relative to the previous camera; choose one with "
                      "--camera");

  ImportedCameras out;
  for (const int n : numbers) {
    const YamlMap fields = chain.map(name_of(n));
    out.cameras.push_back(read_camera(fields, name_of(n)));
    note_timeshift(fields, name_of(n), out.notes);
    if (out.cameras.size() == 2)
      out.second_from_first = chain_pose(fields);
    else if (fields.has("T_cn_cnm1"))
      out.notes.push_back(name_of(n) +
                          ": T_cn_cnm1 is ignored, because it is relative to a camera that is not imported");
  }
  return out;
}

}  // namespace lightwell
