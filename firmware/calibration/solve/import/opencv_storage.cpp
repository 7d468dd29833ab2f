// Reads files of cv::FileStorage, YAML or XML, with the spellings of OpenCV's samples (calibration.cpp,
// camera_calibration.cpp, omni_calibration.cpp) and of the fisheye tutorials (K, D, DIM).
#include <algorithm>
#include <array>

#include <opencv2/core.hpp>

#include <lightwell/text.hpp>

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

class Storage : public Fields {
 public:
  Storage(const cv::FileStorage& storage, std::string name) : storage_(storage), name_(std::move(name)) {}

  [[noreturn]] void refuse(const std::string& key, const std::string& what) const override {
    throw ImportError(name_ + ": " + key + ": " + what);
  }

  [[nodiscard]] bool has(const std::string& key) const override { return !storage_[key].empty(); }

  /// The numbers, row-major, of a matrix with rows, cols and data, a list, or a list of rows.
  [[nodiscard]] std::vector<double> numbers(const std::string& key) const {
    std::vector<double> out;
    const cv::FileNode node = storage_[key];
    if (node.isInt() || node.isReal()) return {static_cast<double>(node)};
    const bool matrix = node.isMap();
    if (!matrix && !node.isSeq()) refuse(key, "must be a matrix or a list of numbers");
    const cv::FileNode data = matrix ? node["data"] : node;
    if (!data.isSeq()) refuse(key, "has no data");
    if (!gather(data, out)) refuse(key, "must be numbers");
    if (matrix) {
      const cv::FileNode rows = node["rows"], cols = node["cols"];
      if (!rows.isInt() || !cols.isInt()) refuse(key, "has no rows and cols");
      const double count = static_cast<double>(rows) * static_cast<double>(cols);
      if (count != static_cast<double>(out.size()))
        refuse(key, "has " + std::to_string(out.size()) + " numbers, rows and cols say " + listed(std::array{count}));
    }
    check_numbers(*this, key, out);
    return out;
  }

  [[nodiscard]] double number(const std::string& key) const {
    const std::vector<double> values = numbers(key);
    if (values.size() != 1) refuse(key, "must be one number");
    return values.front();
  }

  /// A word in lower case; empty if the key is missing.
  [[nodiscard]] std::string word(const std::string& key) const {
    const cv::FileNode node = storage_[key];
    if (node.empty()) return {};
    if (!node.isString()) refuse(key, "must be a word");
    std::string text = node.string();
    for (char& c : text)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return text;
  }

 private:
  static bool gather(const cv::FileNode& sequence, std::vector<double>& out) {
    for (const cv::FileNode element : sequence)
      if (element.isInt() || element.isReal())
        out.push_back(static_cast<double>(element));
      else if (!element.isSeq() || !gather(element, out))
        return false;
    return true;
  }

  const cv::FileStorage& storage_;
  std::string name_;
};

/// Width and height.
std::vector<double> size_of(const Storage& file) {
  static const std::string kRemedy = "; OpenCV's omnidir samples do not write it; add image_width and image_height";
  std::string key = file.find(kSize);
  std::vector<double> size;
  if (key.empty()) {
    key = file.require(kWidth, kRemedy);
    const std::string height = file.require(kHeight, kRemedy);
    size = {file.number(key), file.number(height)};
  } else {
    for (const Names* other : {&kWidth, &kHeight})
      if (const std::string found = file.find(*other); !found.empty())
        file.refuse(key, "has the same meaning as " + found + "; leave one of them out");
    size = file.numbers(key);
    if (size.size() != 2) file.refuse(key, "must be width and height");
  }
  check_size(file, key, size[0], size[1]);
  return size;
}

enum class Lens { unsaid, fisheye, pinhole };

/// The lens model that the file declares.
Lens declared_lens_model(const Storage& file) {
  static const Names kFisheye{"fisheye", "equidistant"};
  static const Names kPinhole{"plumb_bob", "rational_polynomial", "radtan", "pinhole"};
  if (file.has("fisheye_model")) return file.number("fisheye_model") != 0 ? Lens::fisheye : Lens::pinhole;
  const std::string word = file.word("distortion_model");
  if (word.empty()) return Lens::unsaid;
  if (std::ranges::find(kFisheye, word) != kFisheye.end()) return Lens::fisheye;
  if (std::ranges::find(kPinhole, word) != kPinhole.end()) return Lens::pinhole;
  file.refuse("distortion_model", "'" + word + "' is unknown; known are " + joined(kFisheye) + ", " + joined(kPinhole));
}

ModelParameters model_of(const Storage& file, const PinholeFields& p, ImportedCameras& out) {
  const std::string d_key = file.require(kDistortion), xi_key = file.find(kXi);
  const std::vector<double> d = file.numbers(d_key);
  const std::string has = "; it has " + std::to_string(d.size());
  if (!xi_key.empty()) {
    const double xi = file.number(xi_key);
    if (!(xi >= 0)) file.refuse(xi_key, "must be zero or more, it is " + listed(std::array{xi}));
    if (d.size() != 4) file.refuse(d_key, "omnidir has 4 coefficients, k1 k2 p1 p2" + has);
    return *unified_lens(p, xi, d);
  }
  const Lens lens = declared_lens_model(file);
  if (lens == Lens::fisheye || (lens == Lens::unsaid && d.size() == 4)) {
    if (d.size() != 4) file.refuse(d_key, "fisheye has 4 coefficients, k1 k2 k3 k4" + has);
    if (lens == Lens::unsaid)
      out.notes.push_back(
          d_key +
          ": taken as cv::fisheye's k1 k2 k3 k4, because the file does not state the model; k1 k2 p1 p2 of a "
          "pinhole would look the same (write distortion_model: plumb_bob)");
    out.cameras.front().valid_beyond_90_deg = false;
    return kannala_brandt_of(p, d);
  }
  // Numbers of coefficients of cv::calibrateCamera.
  static constexpr std::array<std::size_t, 5> kCounts{4, 5, 8, 12, 14};
  if (std::ranges::find(kCounts, d.size()) == kCounts.end())
    file.refuse(d_key, "must have 4 coefficients for a fisheye, or 4, 5, 8, 12 or 14 for a pinhole" + has);
  if (const auto exact = unified_lens(p, 0, d)) return *exact;
  file.refuse(d_key, no_exact_model("OpenCV's pinhole with " + std::to_string(d.size()) + " coefficients",
                                    "it has more than k1 k2 p1 p2 that are not zero"));
}

ImportedCameras read(const cv::FileStorage& storage, const std::string& name) {
  const Storage file(storage, name);
  if (file.has("camera_matrix_1"))
    file.refuse("camera_matrix_1",
                "a pair of cameras; write each into a file of its own, as camera_matrix, distortion_coefficients and "
                "xi");
  const std::string k_key = file.require(kMatrix, "; other spellings: " + joined(kMatrix));
  const PinholeFields p = pinhole_of(file, k_key, file.numbers(k_key));
  const std::vector<double> size = size_of(file);
  ImportedCameras out;
  out.cameras.push_back({"camera", static_cast<int>(size[0]), static_cast<int>(size[1]), {}, true});
  out.cameras.front().model = model_of(file, p, out);
  return out;
}

}  // namespace

ImportedCameras read_opencv_storage(std::string_view text, const std::string& name) {
  const std::string refusal = ": not a file of cv::FileStorage";
  try {
    const cv::FileStorage storage(std::string(text), cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!storage.isOpened()) throw ImportError(name + refusal + "; YAML begins with %YAML:1.0");
    return read(storage, name);
  } catch (const cv::Exception& e) {
    // For parse errors, OpenCV puts line and text into `func`: "(LINE): what".
    const auto end = e.func.find("): ");
    if (e.code == cv::Error::StsParseError && e.func.starts_with('(') && end != std::string::npos)
      throw ImportError(name + ":" + e.func.substr(1, end - 1) + refusal + ": " + e.func.substr(end + 3));
    throw ImportError(name + refusal + ": " + e.err);
  }
}

}  // namespace lightwell
