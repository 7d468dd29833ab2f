// Reads Kalibr's camchain YAML. Parameters and their order: github.com/ethz-asl/kalibr/wiki/yaml-formats and
// supported-models.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>

#include "calibration/model/lens_pair.hpp"
#include "calibration/solve/import/camera_fields.hpp"
#include "calibration/solve/import/readers.hpp"
#include "calibration/solve/import/yaml_map.hpp"

namespace lightwell {

namespace {

constexpr const char* kKnown = "known are pinhole (with equidistant; radtan and none), ds, omni (radtan or none), eucm";

/// The N of "camN"; empty for another key.
std::optional<int> camera_number(const std::string& key) {
  int n = 0;
  const char* end = key.data() + key.size();
  if (key.size() < 4 || key.compare(0, 3, "cam") != 0) return std::nullopt;
  const auto [stop, error] = std::from_chars(key.data() + 3, end, n);
  if (error != std::errc() || stop != end || n < 0) return std::nullopt;
  return n;
}

std::vector<int> camera_numbers(const YamlMap& chain) {
  std::vector<int> out;
  for (const std::string& key : chain.keys())
    if (const auto n = camera_number(key)) out.push_back(*n);
  std::sort(out.begin(), out.end());
  return out;
}

std::string name_of(int camera) { return "cam" + std::to_string(camera); }

/// A list of `count` finite numbers.
Result<std::vector<double>> exactly(const YamlMap& camera, const std::string& key, std::size_t count,
                                    const std::string& order) {
  Result<std::vector<double>> values = camera.numbers(key);
  if (!values) return values;
  if (values->size() != count)
    return camera.problem(
        key, "must be " + std::to_string(count) + " numbers, " + order + "; it has " + std::to_string(values->size()));
  if (std::string s = numbers_problem(*values); !s.empty()) return camera.problem(key, s);
  return values;
}

class Camera {
 public:
  explicit Camera(const YamlMap& fields) : fields_(fields) {}

  Result<ImportedCamera> read(const std::string& name) {
    ImportedCamera out;
    out.name = name;
    const Result<std::vector<double>> size = exactly(fields_, "resolution", 2, "width and height");
    if (!size) return size.status();
    if (std::string s = size_problem((*size)[0], (*size)[1]); !s.empty()) return fields_.problem("resolution", s);
    out.width = static_cast<int>((*size)[0]);
    out.height = static_cast<int>((*size)[1]);

    const Result<std::string> model = fields_.word("camera_model");
    if (!model) return model.status();
    // Kalibr's examples of models without distortion omit the field.
    distortion_ = "none";
    if (fields_.has("distortion_model")) {
      const Result<std::string> word = fields_.word("distortion_model");
      if (!word) return word.status();
      distortion_ = *word;
    }
    Status done;
    if (*model == "pinhole") {
      done = pinhole(out);
    } else if (*model == "ds") {
      done = double_sphere(out);
    } else if (*model == "omni") {
      done = omni(out);
    } else if (*model == "eucm") {
      done = eucm(out);
    } else {
      done = fields_.problem("camera_model", "'" + *model + "' is unknown; " + kKnown);
    }
    if (!done.ok()) return done;
    return out;
  }

 private:
  /// The pinhole from the last four intrinsics.
  Result<PinholeFields> focal_and_centre(const std::vector<double>& values) const {
    const std::size_t n = values.size();
    const PinholeFields p{values[n - 4], values[n - 3], values[n - 2], values[n - 1]};
    if (std::string s = pinhole_problem(p); !s.empty()) return fields_.problem("intrinsics", s);
    return p;
  }

  [[nodiscard]] Status no_such_distortion(const std::string& model, const std::string& known) const {
    return fields_.problem("distortion_model", "'" + distortion_ + "' is unknown for " + model + "; known: " + known);
  }

  /// Four coefficients; zeros without distortion.
  Result<std::vector<double>> distortion(const std::string& order) const {
    if (distortion_ != "none") return exactly(fields_, "distortion_coeffs", 4, order);
    if (Status s = no_coefficients(); !s.ok()) return s;
    return std::vector<double>(4, 0.0);
  }

  [[nodiscard]] Status no_coefficients() const {
    if (!fields_.has("distortion_coeffs")) return {};
    const Result<std::vector<double>> values = fields_.numbers("distortion_coeffs");
    if (!values) return values.status();
    if (!values->empty())
      return fields_.problem("distortion_coeffs",
                             "distortion_model none has no coefficients; say which model they are of");
    return {};
  }

  Status pinhole(ImportedCamera& out) const {
    const Result<std::vector<double>> values = exactly(fields_, "intrinsics", 4, "fu fv pu pv");
    if (!values) return values.status();
    const Result<PinholeFields> p = focal_and_centre(*values);
    if (!p) return p.status();
    if (distortion_ == "equidistant") {
      const Result<std::vector<double>> k = distortion("k1 k2 k3 k4");
      if (!k) return k.status();
      out.model = kannala_brandt_of(*p, *k);
      out.valid_beyond_90_deg = false;
      return {};
    }
    if (distortion_ == "fov")
      return fields_.problem("distortion_model",
                             no_exact_model("the FOV model (Devernay & Faugeras 2001)", "its radius is an arctangent"));
    if (distortion_ != "radtan" && distortion_ != "none")
      return no_such_distortion("pinhole", "equidistant, radtan, none");
    const Result<std::vector<double>> d = distortion("k1 k2 r1 r2");
    if (!d) return d.status();
    // Always has a value: the Mei model has the same four coefficients.
    out.model = *unified_lens(*p, 0, *d);
    return {};
  }

  Status double_sphere(ImportedCamera& out) const {
    if (distortion_ != "none") return no_such_distortion("ds", "none");
    if (Status s = no_coefficients(); !s.ok()) return s;
    const Result<std::vector<double>> v = exactly(fields_, "intrinsics", 6, "xi alpha fu fv pu pv");
    if (!v) return v.status();
    const Result<PinholeFields> p = focal_and_centre(*v);
    if (!p) return p.status();
    const double xi = (*v)[0], alpha = (*v)[1];
    if (!(xi > -1 && xi < 1) || !(alpha >= 0 && alpha <= 1))
      return fields_.problem("intrinsics", "xi must lie between -1 and 1 and alpha from 0 to 1, they are " +
                                               listed(std::array{xi, alpha}) + "; the order is xi alpha fu fv pu pv");
    out.model = DoubleSphereParameters{p->fx, p->fy, p->cx, p->cy, xi, alpha};
    return {};
  }

  Status omni(ImportedCamera& out) const {
    if (distortion_ != "radtan" && distortion_ != "none") return no_such_distortion("omni", "radtan, none");
    const Result<std::vector<double>> v = exactly(fields_, "intrinsics", 5, "xi fu fv pu pv");
    if (!v) return v.status();
    const Result<PinholeFields> p = focal_and_centre(*v);
    if (!p) return p.status();
    if (!((*v)[0] >= 0))
      return fields_.problem("intrinsics", "xi must be zero or more, it is " + listed(std::array{(*v)[0]}) +
                                               "; the order is xi fu fv pu pv");
    const Result<std::vector<double>> d = distortion("k1 k2 r1 r2");
    if (!d) return d.status();
    out.model = *unified_lens(*p, (*v)[0], *d);
    return {};
  }

  /// Khomutenko et al. 2016, eq. 2 to 4: denominator alpha rho + (1 - alpha) z, rho² = beta (x² + y²) + z².
  Status eucm(ImportedCamera& out) const {
    if (distortion_ != "none") return no_such_distortion("eucm", "none");
    if (Status s = no_coefficients(); !s.ok()) return s;
    const Result<std::vector<double>> v = exactly(fields_, "intrinsics", 6, "alpha beta fu fv pu pv");
    if (!v) return v.status();
    const Result<PinholeFields> p = focal_and_centre(*v);
    if (!p) return p.status();
    const double alpha = (*v)[0], beta = (*v)[1];
    if (!(alpha >= 0 && alpha <= 1))
      return fields_.problem("intrinsics", "alpha must be 0 to 1; the order is alpha beta fu fv pu pv");
    // With beta = 1 it is equal to the double sphere model with xi = 0.
    if (beta != 1)
      return fields_.problem("camera_model", no_exact_model("eucm", "its surface is an ellipsoid, beta " +
                                                                        listed(std::array{beta}) + " instead of 1"));
    out.model = DoubleSphereParameters{p->fx, p->fy, p->cx, p->cy, 0, alpha};
    return {};
  }

  const YamlMap& fields_;
  std::string distortion_;
};

Status note_timeshift(const YamlMap& camera, const std::string& name, std::vector<std::string>& notes) {
  static constexpr const char* kKey = "timeshift_cam_imu";
  if (!camera.has(kKey)) return {};
  const Result<double> shift = camera.number(kKey);
  if (!shift) return shift.status();
  if (!std::isfinite(*shift)) return camera.problem(kKey, "is not finite");
  notes.push_back(name + ": timeshift_cam_imu " + listed(std::array{*shift}) +
                  " s (t_imu = t_cam + shift) is ignored, because a rig has no IMU");
  return {};
}

Result<Pose> chain_pose(const YamlMap& camera) {
  static constexpr const char* kKey = "T_cn_cnm1";
  if (!camera.has(kKey))
    return camera.problem(kKey,
                          "is missing, so the relative pose of the two lenses is unknown; calibrate both together, or "
                          "import one with --camera");
  const Result<std::vector<std::vector<double>>> rows = camera.rows(kKey);
  if (!rows) return rows.status();
  const Result<Pose> pose = pose_of(*rows);
  if (!pose) return camera.problem(kKey, pose.status().message());
  return pose;
}

}  // namespace

Result<YamlFormats> resembled_formats(std::string_view text, const std::string& name) {
  const Result<YamlMap> map = YamlMap::parse(text, name);
  if (!map) return map.status();
  YamlFormats out;
  out.kalibr = !camera_numbers(*map).empty();
  out.ros = map->has("distortion_model") || (map->has("camera_matrix") && map->has("distortion_coefficients"));
  return out;
}

Result<ImportedCameras> read_kalibr_camchain(std::string_view text, const std::string& name,
                                             std::optional<int> camera) {
  const Result<YamlMap> chain = YamlMap::parse(text, name);
  if (!chain) return chain.status();
  std::vector<int> numbers = camera_numbers(*chain);
  std::string names;
  for (const int n : numbers) names += (names.empty() ? "" : ", ") + name_of(n);
  const auto refuse = [&](const std::string& what) { return Status(StatusCode::invalid_argument, name + ": " + what); };
  if (numbers.empty()) return refuse("no cam0: not a camchain of Kalibr's; its cameras stand at the outermost level");
  if (camera) {
    if (std::find(numbers.begin(), numbers.end(), *camera) == numbers.end())
      return refuse("no " + name_of(*camera) + "; there is " + names);
    numbers = {*camera};
  }
  if (numbers.size() > 2)
    return refuse(
        std::to_string(numbers.size()) + " cameras (" + names +
        "), a rig has one or two lenses; choose one with --camera, or write two of them into a file of their own");
  if (numbers.size() == 2 && numbers[1] != numbers[0] + 1)
    return refuse(names +
                  " are not consecutive, but T_cn_cnm1 is relative to the previous camera; choose one with --camera");

  ImportedCameras out;
  for (const int n : numbers) {
    const Result<YamlMap> fields = chain->map(name_of(n));
    if (!fields) return fields.status();
    Result<ImportedCamera> read = Camera(*fields).read(name_of(n));
    if (!read) return read.status();
    out.cameras.push_back(std::move(*read));
    if (Status s = note_timeshift(*fields, name_of(n), out.notes); !s.ok()) return s;
    if (out.cameras.size() == 2) {
      Result<Pose> pose = chain_pose(*fields);
      if (!pose) return pose.status();
      out.second_from_first = *pose;
    } else if (fields->has("T_cn_cnm1")) {
      out.notes.push_back(name_of(n) +
                          ": T_cn_cnm1 is ignored, because it is relative to a camera that is not imported");
    }
  }
  return out;
}

}  // namespace lightwell
