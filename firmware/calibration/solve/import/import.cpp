#include "calibration/solve/import/import.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <variant>

#include <lightwell/files.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/solve/import/readers.hpp"

namespace lightwell {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
// Half the field of view is rounded down to a thousandth of a degree, so that it is still inside the model's domain
// after being written and read. This is about 0.005 pixels for most lenses.
constexpr double kPerDegree = 1000;
// Large, because OpenCV's omnidir sample writes all detected corners into the file.
constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{64} << 20;
// OpenCV's parser has no limit of recursion; calibrations have at most four levels.
constexpr int kMaxNesting = 1000;
// A byte order mark and white space.
constexpr std::string_view kBlank = "\xEF\xBB\xBF \t\r\n";

// Limit of RigParameters::validate().
constexpr double kMaxSide_px = 16384;

std::string text_of(double value) { return formatted("%.9g", value); }

constexpr std::array<std::pair<ImportKind, std::string_view>, 3> kKinds{{
    {ImportKind::opencv, "opencv"},
    {ImportKind::kalibr, "kalibr"},
    {ImportKind::ros, "ros"},
}};

std::string degrees(double rad) { return formatted("%.3f", rad / kDegree); }

double down_to_a_thousandth(double rad) { return std::floor(rad / kDegree * kPerDegree) / kPerDegree * kDegree; }

/// Nesting depth of brackets, tags and dashes, a bound on the parsers' recursion.
int nesting(std::string_view text) {
  int depth = 0, deepest = 0, dashes = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : '\n';
    if (c == '[' || c == '{' || (c == '<' && next != '/' && next != '!' && next != '?'))
      ++depth;
    else if (c == ']' || c == '}' || (c == '<' && next == '/') || (c == '/' && next == '>'))
      depth = std::max(depth - 1, 0);
    // "- - - 1" is three nested lists.
    if (c == '-' && (next == ' ' || next == '\t'))
      ++dashes;
    else if (c != ' ' && c != '\t')
      dashes = 0;
    deepest = std::max({deepest, depth, dashes});
  }
  return deepest;
}

ImportKind kind_of(std::string_view text, const std::string& name) {
  const std::string_view body = text.substr(text.find_first_not_of(kBlank));
  if (body.starts_with("<?xml") || body.starts_with("<opencv_storage") || body.starts_with("%YAML:") ||
      body.find("!!opencv-matrix") != std::string_view::npos)
    return ImportKind::opencv;
  try {
    if (const auto kind = resembled_kind(text, name)) return *kind;
  } catch (const ImportError&) {
    // If the text resembles one of the YAML formats, the parser's error is the most useful message.
    for (const std::string_view word : {"cam0:", "camera_matrix:", "distortion_model:"})
      if (body.find(word) != std::string_view::npos) throw;
  }
  throw ImportError(
      name +
      ": none of the known kinds of calibration: opencv begins with %YAML:1.0 or <?xml, kalibr has cam0, ros has "
      "camera_matrix and distortion_model; --kind selects one of them");
}

ImportedCameras read(std::string_view text, const std::string& name, ImportKind kind, std::optional<int> camera) {
  if (kind == ImportKind::kalibr) return read_kalibr_camchain(text, name, camera);
  if (camera && *camera != 0) throw ImportError(name + ": has one camera, number 0; leave --camera out");
  return kind == ImportKind::opencv ? read_opencv_storage(text, name) : read_ros_camera_info(text, name);
}

/// Half the field of view of a lens, rad. Adds the reason to the notes.
double max_angle_of(const std::string& name, const ImportedCamera& camera, const ImportOptions& options,
                    const LensParameters& lens, std::vector<std::string>& notes) {
  const FieldOfView view = field_of_view(lens);
  double angle = options.max_angle_rad.value_or(view.model_rad);
  std::string why;
  if (angle > view.model_rad) {
    angle = down_to_a_thousandth(view.model_rad);
    why = "the end of the model's domain; beyond, two directions would project to the same pixel";
  } else if (!options.max_angle_rad) {
    if (!view.circle_rad)
      throw ImportError(name + ": " + camera.name +
                        ": the principal point is outside the picture, so no circle round it determines the field of "
                        "view; give --max-angle-deg");
    angle = down_to_a_thousandth(*view.circle_rad);
    why = *view.circle_rad < view.model_rad
              ? "the edge of the largest circle that fits into the picture; use --max-angle-deg if the lens's circle "
                "is smaller, or cut by the picture (the model goes on to " +
                    degrees(view.model_rad) + ")"
              : "the end of the model's domain, inside the picture; --max-angle-deg lowers it";
  }
  if (!(angle > 0))
    throw ImportError(name + ": " + camera.name + ": the model's domain is empty; check its coefficients");
  if (!why.empty()) notes.push_back(camera.name + ": max_angle_deg " + degrees(angle) + ", " + why);
  if (angle > std::numbers::pi / 2 && !camera.valid_beyond_90_deg)
    notes.push_back(camera.name +
                    ": beyond 90 degrees the polynomial is an extrapolation: the calibration saw nothing "
                    "behind the lens's plane (z > 0)");
  return angle;
}

ImportedCalibration rig_of(const ImportedCameras& read, ImportKind kind, const std::string& name,
                           const ImportOptions& options) {
  ImportedCalibration out;
  out.kind = kind;
  for (const ImportedCamera& camera : read.cameras) {
    LensParameters lens{camera.width, camera.height, camera.model, 0, {upright_lens_cv(), {}}, {}};
    lens.max_angle_rad = max_angle_of(name, camera, options, lens, out.notes);
    out.rig.lenses.push_back(lens);
    out.cameras.push_back(camera.name);
  }
  if (out.rig.lenses.size() == 2) {
    const std::array<Pose, 2> poses = pair_in_probe(read.second_from_first);
    for (std::size_t i = 0; i < 2; ++i) out.rig.lenses[i].pose_cv = poses[i];
    const double between = angle_between(Vec3d{0, 0, 1}, rotate(read.second_from_first.rotation, Vec3d{0, 0, 1}));
    if (between < std::numbers::pi / 2)
      out.notes.push_back("the axes of " + out.cameras[0] + " and " + out.cameras[1] + " are " + degrees(between) +
                          " degrees apart: not a pair back to back; --camera imports one");
  }
  out.notes.insert(out.notes.end(), read.notes.begin(), read.notes.end());
  if (const Status s = out.rig.validate(); !s.ok()) throw ImportError(name + ": " + s.message());
  return out;
}

}  // namespace

std::string Fields::find(const std::vector<std::string>& spellings) const {
  std::string found;
  for (const std::string& key : spellings) {
    if (!has(key)) continue;
    if (!found.empty()) refuse(key, "has the same meaning as " + found + "; leave one of them out");
    found = key;
  }
  return found;
}

std::string Fields::require(const std::vector<std::string>& spellings, const std::string& remedy) const {
  const std::string found = find(spellings);
  if (found.empty()) refuse(spellings.front(), "is missing" + remedy);
  return found;
}

std::string listed(std::span<const double> values) {
  std::string out;
  for (const double v : values) out += (out.empty() ? "" : ", ") + text_of(v);
  return out;
}

void check_size(const Fields& fields, const std::string& key, double width, double height) {
  for (const double side : {width, height})
    if (!(side >= 1 && side <= kMaxSide_px) || side != std::floor(side))
      fields.refuse(
          key, "a picture of " + text_of(width) + " x " + text_of(height) + " pixels; whole numbers from 1 to 16384");
}

void check_numbers(const Fields& fields, const std::string& key, std::span<const double> values) {
  for (const double v : values)
    if (!std::isfinite(v))
      fields.refuse(key, "has a value that is not finite (" + listed(values) + "); calibrate again");
}

void check_pinhole(const Fields& fields, const std::string& key, const PinholeFields& p) {
  check_numbers(fields, key, std::array{p.fx, p.fy, p.cx, p.cy});
  if (!(p.fx > 0) || !(p.fy > 0))
    fields.refuse(key, "focal lengths must be positive, they are " + text_of(p.fx) + " and " + text_of(p.fy) +
                           "; zero means a camera that was never calibrated");
}

PinholeFields pinhole_of(const Fields& fields, const std::string& key, std::span<const double> k) {
  if (k.size() != 9) fields.refuse(key, "needs 3 x 3 numbers, it has " + std::to_string(k.size()));
  check_numbers(fields, key, k);
  if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    fields.refuse(key, "must be fx 0 cx, 0 fy cy, 0 0 1, row by row; it is " + listed(k));
  if (k[1] != 0)
    fields.refuse(key, "has a skew of " + text_of(k[1]) +
                           ", which is not supported; calibrate again with it fixed at zero (OpenCV: CALIB_FIX_SKEW)");
  const PinholeFields p{k[0], k[4], k[2], k[5]};
  check_pinhole(fields, key, p);
  return p;
}

KannalaBrandtParameters kannala_brandt_of(const PinholeFields& p, std::span<const double> k) {
  return {p.fx, p.fy, p.cx, p.cy, k[0], k[1], k[2], k[3]};
}

std::optional<ModelParameters> unified_lens(const PinholeFields& p, double xi, std::span<const double> d) {
  std::array<double, 4> first{};
  std::copy_n(d.begin(), std::min(d.size(), first.size()), first.begin());
  const auto rest = d.subspan(std::min(d.size(), first.size()));
  if (std::any_of(rest.begin(), rest.end(), [](double v) { return v != 0; })) return std::nullopt;
  return MeiParameters{p.fx, p.fy, p.cx, p.cy, xi, first[0], first[1], first[2], first[3]};
}

std::string no_exact_model(const std::string& model, const std::string& why) {
  return model + " is not supported, and no supported model is exactly equal: " + why +
         "; calibrate again with Kalibr's pinhole-equi, ds-none or omni-radtan, or with OpenCV's fisheye or omnidir";
}

FieldOfView field_of_view(const LensParameters& lens) {
  LensParameters whole = lens;
  whole.max_angle_rad = std::numbers::pi;
  const CameraModel model(whole);
  FieldOfView out;
  out.model_rad = model.max_angle_rad();
  const auto centre = model.project({0, 0, 1});
  if (!centre) return out;
  // The edge of the picture is the outer edge of its outermost pixels.
  const double radius =
      std::min({centre->x + 0.5, lens.width - 0.5 - centre->x, centre->y + 0.5, lens.height - 0.5 - centre->y});
  if (!(radius > 0)) return out;
  double angle = out.model_rad;
  // Tangential distortion varies with the azimuth and its double: steps of half a degree suffice.
  constexpr int kAzimuths = 720;
  for (int i = 0; i < kAzimuths; ++i) {
    const double phi = 2 * std::numbers::pi * i / kAzimuths;
    const auto d = model.unproject({centre->x + radius * std::cos(phi), centre->y + radius * std::sin(phi)});
    // A point of the circle without a direction is beyond the model's domain, which model_rad already limits.
    if (d) angle = std::min(angle, std::atan2(std::hypot(d->x, d->y), d->z));
  }
  out.circle_rad = angle;
  return out;
}

std::string_view to_string(ImportKind kind) {
  for (const auto& [k, name] : kKinds)
    if (k == kind) return name;
  return "unknown";
}

Result<ImportKind> parse_import_kind(std::string_view name) {
  for (const auto& [kind, known] : kKinds)
    if (known == name) return kind;
  return invalid_argument("'" + std::string(name) + "' is not a kind of calibration; known are opencv, kalibr and ros");
}

std::string_view model_name(const ModelParameters& model) {
  if (std::holds_alternative<KannalaBrandtParameters>(model)) return "kannala_brandt";
  if (std::holds_alternative<DoubleSphereParameters>(model)) return "double_sphere";
  if (std::holds_alternative<MeiParameters>(model)) return "mei";
  return "equirectangular";
}

Status ImportOptions::validate() const {
  if (camera && *camera < 0) return invalid_argument("--camera must be 0 or more");
  if (max_angle_rad && !(*max_angle_rad > 0 && *max_angle_rad <= std::numbers::pi))
    return invalid_argument("--max-angle-deg must be above 0 and at most 180 (half the field of view)");
  return {};
}

Result<ImportedCalibration> import_calibration(std::string_view text, const std::string& name,
                                               const ImportOptions& options) {
  if (Status s = options.validate(); !s.ok()) return s;
  if (nesting(text) > kMaxNesting)
    return invalid_argument(name + ": nests deeper than any calibration; is it the right file?");
  if (!options.kind && text.find_first_not_of(kBlank) == std::string_view::npos)
    return Status(StatusCode::data_loss, name + ": is empty; copy it again");
  try {
    const ImportKind kind = options.kind ? *options.kind : kind_of(text, name);
    return rig_of(read(text, name, kind, options.camera), kind, name, options);
  } catch (const ImportError& e) {
    return invalid_argument(e.what());
  }
}

Result<ImportedCalibration> import_calibration_file(const std::string& path, const ImportOptions& options) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found)
    return Status(StatusCode::not_found, path + ": there is no such file");
  if (status.type() != std::filesystem::file_type::regular) return invalid_argument(path + ": not a file");
  if (std::filesystem::file_size(path, error) > kMaxFileBytes || error)
    return invalid_argument(path + ": larger than 64 MiB, which no calibration is");
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return import_calibration(*text, path, options);
}

}  // namespace lightwell
