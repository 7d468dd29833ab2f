#include "calibration/solve/import/import.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <variant>

#include "calibration/model/lens_pair.hpp"
#include "calibration/solve/import/field_of_view.hpp"
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

constexpr std::array<std::pair<ImportKind, std::string_view>, 3> kKinds{{
    {ImportKind::opencv, "opencv"},
    {ImportKind::kalibr, "kalibr"},
    {ImportKind::ros, "ros"},
}};

std::string degrees(double rad) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", rad / kDegree);
  return text;
}

double down_to_a_thousandth(double rad) { return std::floor(rad / kDegree * kPerDegree) / kPerDegree * kDegree; }

/// Nesting depth of brackets, tags and dashes, a bound on the parsers' recursion.
int nesting(std::string_view text) {
  int depth = 0, deepest = 0, dashes = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : '\n';
    if (c == '[' || c == '{' || (c == '<' && next != '/' && next != '!' && next != '?')) {
      ++depth;
    } else if (c == ']' || c == '}' || (c == '<' && next == '/') || (c == '/' && next == '>')) {
      depth = std::max(depth - 1, 0);
    }
    // "- - - 1" is three nested lists.
    if (c == '-' && (next == ' ' || next == '\t')) {
      ++dashes;
    } else if (c != ' ' && c != '\t') {
      dashes = 0;
    }
    deepest = std::max({deepest, depth, dashes});
  }
  return deepest;
}

Result<ImportKind> kind_of(std::string_view text, const std::string& name) {
  // Skip a byte order mark and blank lines.
  const auto begin = text.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  const std::string_view body = begin == std::string_view::npos ? std::string_view() : text.substr(begin);
  if (body.empty()) return Status(StatusCode::data_loss, name + ": is empty; copy it again");
  if (body.starts_with("<?xml") || body.starts_with("<opencv_storage") || body.starts_with("%YAML:") ||
      body.find("!!opencv-matrix") != std::string_view::npos)
    return ImportKind::opencv;
  const Result<YamlFormats> formats = resembled_formats(text, name);
  if (formats && formats->kalibr != formats->ros) return formats->kalibr ? ImportKind::kalibr : ImportKind::ros;
  // If the text resembles one of the YAML formats, the parser's error is the most useful message.
  for (const std::string_view word : {"cam0:", "camera_matrix:", "distortion_model:"})
    if (!formats && body.find(word) != std::string_view::npos) return formats.status();
  return Status(StatusCode::invalid_argument,
                name +
                    ": none of the known kinds of calibration: opencv begins with %YAML:1.0 or <?xml, kalibr has cam0, "
                    "ros has camera_matrix and distortion_model; --kind selects one of them");
}

Result<ImportedCameras> read(std::string_view text, const std::string& name, ImportKind kind,
                             std::optional<int> camera) {
  if (kind == ImportKind::kalibr) return read_kalibr_camchain(text, name, camera);
  if (camera && *camera != 0)
    return Status(StatusCode::invalid_argument, name + ": has one camera, number 0; leave --camera out");
  return kind == ImportKind::opencv ? read_opencv_storage(text, name) : read_ros_camera_info(text, name);
}

/// Sets max_angle_rad of a lens, and adds the reason to the notes.
Status set_angle(const ImportedCamera& camera, const ImportOptions& options, LensParameters& lens,
                 std::vector<std::string>& notes) {
  const FieldOfView view = field_of_view(lens);
  double angle = view.model_rad;
  std::string why;
  if (options.max_angle_rad) {
    angle = *options.max_angle_rad;
    if (angle > view.model_rad) {
      angle = down_to_a_thousandth(view.model_rad);
      why = "the end of the model's domain; beyond, two directions would project to the same pixel";
    }
  } else {
    if (!view.circle_rad)
      return {StatusCode::invalid_argument, camera.name +
                                                ": the principal point is outside the picture, so no circle round "
                                                "it determines the field of view; give --max-angle-deg"};
    angle = down_to_a_thousandth(*view.circle_rad);
    why = *view.circle_rad < view.model_rad
              ? "the edge of the largest circle that fits into the picture; "
                "use --max-angle-deg if the lens's "
                "circle is smaller, or cut by the picture (the model goes on to " +
                    degrees(view.model_rad) + ")"
              : "the end of the model's domain, inside the picture; --max-angle-deg lowers it";
  }
  if (!(angle > 0))
    return {StatusCode::invalid_argument, camera.name + ": the model's domain is empty; check its coefficients"};
  lens.max_angle_rad = angle;
  if (!why.empty()) notes.push_back(camera.name + ": max_angle_deg " + degrees(angle) + ", " + why);
  if (angle > std::numbers::pi / 2 && !camera.valid_beyond_90_deg)
    notes.push_back(camera.name +
                    ": beyond 90 degrees the polynomial is an extrapolation: the calibration saw nothing "
                    "behind the lens's plane (z > 0)");
  return {};
}

}  // namespace

std::string_view to_string(ImportKind kind) {
  for (const auto& [k, name] : kKinds)
    if (k == kind) return name;
  return "unknown";
}

std::optional<ImportKind> import_kind(std::string_view name) {
  for (const auto& [kind, known] : kKinds)
    if (known == name) return kind;
  return std::nullopt;
}

std::string_view model_name(const ModelParameters& model) {
  if (std::holds_alternative<KannalaBrandtParameters>(model)) return "kannala_brandt";
  if (std::holds_alternative<DoubleSphereParameters>(model)) return "double_sphere";
  if (std::holds_alternative<MeiParameters>(model)) return "mei";
  return "equirectangular";
}

Status ImportOptions::validate() const {
  if (camera && *camera < 0) return {StatusCode::invalid_argument, "--camera must be 0 or more"};
  if (max_angle_rad && !(*max_angle_rad > 0 && *max_angle_rad <= std::numbers::pi))
    return {StatusCode::invalid_argument, "--max-angle-deg must be above 0 and at most 180 (half the field of view)"};
  return {};
}

Result<ImportedCalibration> import_calibration(std::string_view text, const std::string& name,
                                               const ImportOptions& options) {
  if (Status s = options.validate(); !s.ok()) return s;
  if (nesting(text) > kMaxNesting)
    return Status(StatusCode::invalid_argument, name + ": nests deeper than any calibration; is it the right file?");
  const Result<ImportKind> kind = options.kind ? Result<ImportKind>(*options.kind) : kind_of(text, name);
  if (!kind) return kind.status();
  const Result<ImportedCameras> read_in = read(text, name, *kind, options.camera);
  if (!read_in) return read_in.status();

  ImportedCalibration out;
  out.kind = *kind;
  for (const ImportedCamera& camera : read_in->cameras) {
    LensParameters lens;
    lens.width = camera.width;
    lens.height = camera.height;
    lens.model = camera.model;
    lens.pose_cv.rotation = upright_lens_cv();
    if (Status s = set_angle(camera, options, lens, out.notes); !s.ok())
      return Status(s.code(), name + ": " + s.message());
    out.rig.lenses.push_back(lens);
    out.cameras.push_back(camera.name);
  }
  if (out.rig.lenses.size() == 2) {
    const std::array<Pose, 2> poses = pair_in_probe(read_in->second_from_first);
    for (std::size_t i = 0; i < 2; ++i) out.rig.lenses[i].pose_cv = poses[i];
    const double between = angle_between_axes(read_in->second_from_first);
    if (between < std::numbers::pi / 2)
      out.notes.push_back("the axes of " + out.cameras[0] + " and " + out.cameras[1] + " are " + degrees(between) +
                          " degrees apart: not a pair back to back; --camera imports one");
  }
  out.notes.insert(out.notes.end(), read_in->notes.begin(), read_in->notes.end());
  if (const Status s = out.rig.validate(); !s.ok()) return Status(s.code(), name + ": " + s.message());
  return out;
}

Result<ImportedCalibration> import_calibration_file(const std::string& path, const ImportOptions& options) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found)
    return Status(StatusCode::not_found, path + ": there is no such file");
  if (status.type() != std::filesystem::file_type::regular)
    return Status(StatusCode::invalid_argument, path + ": not a file");
  if (std::filesystem::file_size(path, error) > kMaxFileBytes || error)
    return Status(StatusCode::invalid_argument, path + ": larger than 64 MiB, which no calibration is");
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in) return Status(StatusCode::failed_precondition, path + ": cannot be read");
  return import_calibration(text, path, options);
}

}  // namespace lightwell
