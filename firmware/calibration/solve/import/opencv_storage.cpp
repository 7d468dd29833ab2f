// Reads files of cv::FileStorage, YAML or XML, with the spellings of OpenCV's samples (calibration.cpp,
// camera_calibration.cpp, omni_calibration.cpp) and of the fisheye tutorials (K, D, DIM).
#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/core.hpp>

#include <lightwell/text.hpp>

#include "calibration/solve/import/camera_fields.hpp"
#include "calibration/solve/import/readers.hpp"

namespace lightwell {

namespace {

using Names = std::vector<std::string>;

const Names kMatrix{"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K"};
const Names kDistortion{"distortion_coefficients",
                        "Distortion_Coefficients",
                        "DistortionCoefficients",
                        "dist_coeffs",
                        "distCoeffs",
                        "dist_coefs",
                        "D"};
const Names kXi{"xi", "Xi"};
const Names kWidth{"image_width", "image_Width", "imageWidth", "ImageWidth", "width"};
const Names kHeight{"image_height", "image_Height", "imageHeight", "ImageHeight", "height"};
const Names kSize{"image_size", "imageSize", "DIM", "resolution"};

/// A field, with its key for messages.
struct Field {
  std::string key;
  cv::FileNode node;
};

class Storage {
 public:
  Storage(const cv::FileStorage& storage, std::string name) : storage_(storage), name_(std::move(name)) {}

  [[nodiscard]] Status problem(const std::string& key, const std::string& what) const {
    return {StatusCode::invalid_argument, name_ + ": " + key + ": " + what};
  }

  /// The key is empty if none of the spellings is present.
  [[nodiscard]] Result<Field> find(const Names& spellings) const {
    Field found;
    for (const std::string& key : spellings) {
      const cv::FileNode node = storage_[key];
      if (node.empty()) continue;
      if (!found.key.empty()) return problem(key, "has the same meaning as " + found.key + "; leave one of them out");
      found = {key, node};
    }
    return found;
  }

  [[nodiscard]] bool has(const std::string& key) const { return !storage_[key].empty(); }

  /// The numbers, row-major, of a matrix with rows, cols and data, a list, or a list of rows.
  [[nodiscard]] Result<std::vector<double>> numbers(const Field& field) const {
    std::vector<double> out;
    const cv::FileNode& node = field.node;
    if (node.isInt() || node.isReal()) return std::vector<double>{static_cast<double>(node)};
    const bool matrix = node.isMap();
    if (!matrix && !node.isSeq()) return problem(field.key, "must be a matrix or a list of numbers");
    const cv::FileNode data = matrix ? node["data"] : node;
    if (!data.isSeq()) return problem(field.key, "has no data");
    if (!gather(data, out)) return problem(field.key, "must be numbers");
    if (matrix) {
      const cv::FileNode rows = node["rows"], cols = node["cols"];
      if (!rows.isInt() || !cols.isInt()) return problem(field.key, "has no rows and cols");
      if (static_cast<double>(rows) * static_cast<double>(cols) != static_cast<double>(out.size()))
        return problem(field.key, "has " + std::to_string(out.size()) + " numbers, rows and cols say " +
                                      listed(std::array{static_cast<double>(rows) * static_cast<double>(cols)}));
    }
    if (std::string s = numbers_problem(out); !s.empty()) return problem(field.key, s);
    return out;
  }

  [[nodiscard]] Result<double> number(const Field& field) const {
    const Result<std::vector<double>> values = numbers(field);
    if (!values) return values.status();
    if (values->size() != 1) return problem(field.key, "must be one number");
    return values->front();
  }

  /// A word in lower case; empty if the key is missing.
  [[nodiscard]] Result<std::string> word(const std::string& key) const {
    const cv::FileNode node = storage_[key];
    if (node.empty()) return std::string();
    if (!node.isString()) return problem(key, "must be a word");
    std::string text = node.string();
    for (char& c : text)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return text;
  }

 private:
  static bool gather(const cv::FileNode& sequence, std::vector<double>& out) {
    for (const cv::FileNode element : sequence) {
      if (element.isInt() || element.isReal())
        out.push_back(static_cast<double>(element));
      else if (!element.isSeq() || !gather(element, out))
        return false;
    }
    return true;
  }

  const cv::FileStorage& storage_;
  std::string name_;
};

struct Size {
  double width = 0, height = 0;
};

Result<Size> size_of(const Storage& file) {
  static const std::string kRemedy = "OpenCV's omnidir samples do not write it; add image_width and image_height";
  const Result<Field> width = file.find(kWidth), height = file.find(kHeight), both = file.find(kSize);
  for (const Result<Field>* f : {&width, &height, &both})
    if (!*f) return f->status();
  Size out;
  std::string key = width->key;
  if (!both->key.empty()) {
    key = both->key;
    if (!width->key.empty() || !height->key.empty())
      return file.problem(key, "has the same meaning as " + (width->key.empty() ? height->key : width->key) +
                                   "; leave one of them out");
    const Result<std::vector<double>> values = file.numbers(*both);
    if (!values) return values.status();
    if (values->size() != 2) return file.problem(key, "must be width and height");
    out = {(*values)[0], (*values)[1]};
  } else {
    if (width->key.empty()) return file.problem(kWidth.front(), "is missing; " + kRemedy);
    if (height->key.empty()) return file.problem(kHeight.front(), "is missing; " + kRemedy);
    const Result<double> w = file.number(*width), h = file.number(*height);
    if (!w) return w.status();
    if (!h) return h.status();
    out = {*w, *h};
  }
  if (std::string s = size_problem(out.width, out.height); !s.empty()) return file.problem(key, s);
  return out;
}

enum class Lens { unsaid, fisheye, pinhole };

/// The lens model that the file declares.
Result<Lens> declared_lens_model(const Storage& file) {
  static const Names kFisheye{"fisheye", "equidistant"};
  static const Names kPinhole{"plumb_bob", "rational_polynomial", "radtan", "pinhole"};
  const Result<Field> flag = file.find({"fisheye_model"});
  if (!flag) return flag.status();
  if (!flag->key.empty()) {
    const Result<double> value = file.number(*flag);
    if (!value) return value.status();
    return *value != 0 ? Lens::fisheye : Lens::pinhole;
  }
  const Result<std::string> word = file.word("distortion_model");
  if (!word) return word.status();
  if (word->empty()) return Lens::unsaid;
  for (const std::string& w : kFisheye)
    if (*word == w) return Lens::fisheye;
  for (const std::string& w : kPinhole)
    if (*word == w) return Lens::pinhole;
  return file.problem("distortion_model",
                      "'" + *word + "' is unknown; known are " + joined(kFisheye) + ", " + joined(kPinhole));
}

Result<ModelParameters> model_of(const Storage& file, const PinholeFields& p, ImportedCameras& out) {
  const Result<Field> d_field = file.find(kDistortion), xi_field = file.find(kXi);
  if (!d_field) return d_field.status();
  if (!xi_field) return xi_field.status();
  if (d_field->key.empty()) return file.problem(kDistortion.front(), "is missing");
  const Result<std::vector<double>> d = file.numbers(*d_field);
  if (!d) return d.status();
  const std::string has = "; it has " + std::to_string(d->size());

  if (!xi_field->key.empty()) {
    const Result<double> xi = file.number(*xi_field);
    if (!xi) return xi.status();
    if (!(*xi >= 0)) return file.problem(xi_field->key, "must be zero or more, it is " + listed(std::array{*xi}));
    if (d->size() != 4) return file.problem(d_field->key, "omnidir has 4 coefficients, k1 k2 p1 p2" + has);
    return *unified_lens(p, *xi, *d);
  }
  const Result<Lens> lens = declared_lens_model(file);
  if (!lens) return lens.status();
  if (*lens == Lens::fisheye || (*lens == Lens::unsaid && d->size() == 4)) {
    if (d->size() != 4) return file.problem(d_field->key, "fisheye has 4 coefficients, k1 k2 k3 k4" + has);
    if (*lens == Lens::unsaid)
      out.notes.push_back(
          d_field->key +
          ": taken as cv::fisheye's k1 k2 k3 k4, because the file does not state the model; k1 k2 p1 p2 of a "
          "pinhole would look the same (write distortion_model: plumb_bob)");
    out.cameras.front().valid_beyond_90_deg = false;
    return ModelParameters(kannala_brandt_of(p, *d));
  }
  // Numbers of coefficients of cv::calibrateCamera.
  static constexpr std::array<std::size_t, 5> kCounts{4, 5, 8, 12, 14};
  if (std::find(kCounts.begin(), kCounts.end(), d->size()) == kCounts.end())
    return file.problem(d_field->key,
                        "must have 4 coefficients for a fisheye, or 4, 5, 8, 12 or 14 for a pinhole" + has);
  if (const auto exact = unified_lens(p, 0, *d)) return *exact;
  return file.problem(d_field->key,
                      no_exact_model("OpenCV's pinhole with " + std::to_string(d->size()) + " coefficients",
                                     "it has more than k1 k2 p1 p2 that are not zero"));
}

Result<ImportedCameras> read(const cv::FileStorage& storage, const std::string& name) {
  const Storage file(storage, name);
  if (file.has("camera_matrix_1"))
    return file.problem("camera_matrix_1",
                        "a pair of cameras; write each into a file of its own, as camera_matrix, "
                        "distortion_coefficients and xi");
  const Result<Field> k_field = file.find(kMatrix);
  if (!k_field) return k_field.status();
  if (k_field->key.empty()) return file.problem(kMatrix.front(), "is missing; other spellings: " + joined(kMatrix));
  const Result<std::vector<double>> k = file.numbers(*k_field);
  if (!k) return k.status();
  if (std::string s = camera_matrix_problem(*k); !s.empty()) return file.problem(k_field->key, s);
  const Result<Size> size = size_of(file);
  if (!size) return size.status();

  ImportedCameras out;
  ImportedCamera& camera = out.cameras.emplace_back();
  camera.name = "camera";
  camera.width = static_cast<int>(size->width);
  camera.height = static_cast<int>(size->height);
  const Result<ModelParameters> model = model_of(file, pinhole_of(*k), out);
  if (!model) return model.status();
  camera.model = *model;
  return out;
}

}  // namespace

Result<ImportedCameras> read_opencv_storage(std::string_view text, const std::string& name) {
  try {
    const cv::FileStorage storage(std::string(text), cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!storage.isOpened())
      return Status(StatusCode::invalid_argument, name + ": not a file of cv::FileStorage; YAML begins with %YAML:1.0");
    return read(storage, name);
  } catch (const cv::Exception& e) {
    // For parse errors, OpenCV puts line and text into `func`: "(LINE): what".
    const auto end = e.func.find("): ");
    if (e.code == cv::Error::StsParseError && e.func.starts_with('(') && end != std::string::npos)
      return Status(StatusCode::invalid_argument, name + ":" + e.func.substr(1, end - 1) +
                                                      ": not a file of cv::FileStorage: " + e.func.substr(end + 3));
    return Status(StatusCode::invalid_argument, name + ": not a file of cv::FileStorage: " + e.err);
  }
}

}  // namespace lightwell
