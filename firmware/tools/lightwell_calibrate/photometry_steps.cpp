#include "tools/lightwell_calibrate/photometry_steps.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>

#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/vignetting.hpp"
#include "camera/backends/replay/frame_list.hpp"
#include "tools/lens_image.hpp"

namespace lightwell::calibrate {
namespace {

namespace fs = std::filesystem;
using photometry::Picture;

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, what}; }

struct ListedPicture {
  std::string path, file;  ///< `file`: the name in the list.
  double exposure_s = 1, gain = 1;
};

/// Reads FOLDER/frames.csv (camera/backends/replay/frame_list.hpp): of each frame the picture of the lens, or the only
/// one.
Result<std::vector<ListedPicture>> list_pictures(const std::string& folder, int lens) {
  const Result<std::vector<replay::ListedFrame>> frames = replay::load_frame_list(folder);
  if (!frames) return frames.status();
  std::vector<ListedPicture> out;
  for (const replay::ListedFrame& frame : *frames) {
    const std::size_t index = frame.files.size() > 1 ? static_cast<std::size_t>(lens) : 0;
    if (index >= frame.files.size())
      return invalid((fs::path(folder) / "frames.csv").string() + ": no picture of lens " + std::to_string(lens) +
                     "; see --lens");
    const std::string& name = frame.files[index];
    out.push_back({(fs::path(folder) / name).string(), name, frame.info.exposure_s, frame.info.gain});
  }
  return out;
}

/// Reads FOLDER/angles.csv with the header "file,angle_deg": angles in rad by file. Empty if there is no such file.
Result<std::map<std::string, double>> read_angles(const std::string& folder) {
  std::map<std::string, double> out;
  const std::string path = (fs::path(folder) / "angles.csv").string();
  std::error_code error;
  if (!fs::exists(path, error)) return out;
  std::ifstream file(path);
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const auto bad = [&](const std::string& what) {
      return invalid(path + ":" + std::to_string(number) + ": " + what);
    };
    if (trimmed(line).empty()) continue;
    const std::vector<std::string_view> fields = comma_separated(line);
    if (fields.size() != 2) return bad("it does not have the two columns file,angle_deg");
    const std::string name(fields[0]), value(fields[1]);
    if (number == 1) {
      if (name != "file" || value != "angle_deg") return bad("the first line must be file,angle_deg");
      continue;
    }
    const std::optional<double> degrees = parse_number<double>(value);
    if (!degrees || !(*degrees >= 0 && *degrees <= 180))
      return bad("angle_deg '" + value + "' is not an angle of 0 to 180");
    if (!out.emplace(name, *degrees * std::numbers::pi / 180).second) return bad(name + " is listed twice");
  }
  if (out.empty())
    return invalid(path + ": no angle is listed; without this file angles are those of the lens's geometry");
  return out;
}

struct Series {
  std::vector<ListedPicture> list;
  std::vector<Picture> pictures;
};

class Steps {
 public:
  Steps(PhotometryRun& run, const PhotometryInputs& inputs)
      : run_(run), in_(inputs), lens_(run.rig.lenses[static_cast<std::size_t>(inputs.lens)]) {}

  [[nodiscard]] Status run() {
    for (const auto step :
         {&Steps::read_dark, &Steps::response, &Steps::dark, &Steps::flat, &Steps::lamp, &Steps::grey})
      if (Status s = (this->*step)(); !s.ok()) return s;
    return {};
  }

 private:
  /// PNG, JPEG, OpenEXR or HDR; floats are relative to full scale.
  [[nodiscard]] Result<Picture> read_picture(const std::string& path) const {
    const Result<Image> image = read_lens_image(path, run_.rig, in_.lens);
    if (!image) return image.status();
    return photometry::picture_of(view_of(*image, in_.lens), path, in_.bits > 0 ? 1 << in_.bits : 0);
  }

  [[nodiscard]] Result<Series> read_series(const std::string& folder) const {
    Result<std::vector<ListedPicture>> list = list_pictures(folder, in_.lens);
    if (!list) return list.status();
    Series out{std::move(*list), {}};
    for (const ListedPicture& p : out.list) {
      Result<Picture> picture = read_picture(p.path);
      if (!picture) return picture.status();
      out.pictures.push_back(std::move(*picture));
    }
    return out;
  }

  [[nodiscard]] PhotometricCalibration& photometry() { return lens_.photometry; }

  Status read_dark() {
    dark_value_ = encoded(photometry().response, photometry().black_level);
    if (in_.dark.empty()) return {};
    Result<Series> series = read_series(in_.dark);
    if (!series) return series.status();
    dark_ = std::move(*series);
    for (const ListedPicture& p : dark_.list)
      if (p.gain != dark_.list.front().gain)
        return invalid(p.path + ": its gain differs from that of the first dark picture; take all with the same gain");
    const Result<double> value = photometry::dark_value_of(dark_.pictures);
    if (!value) return value.status();
    dark_value_ = *value;
    return {};
  }

  Status response() {
    if (in_.response.empty()) return {};
    const Result<Series> series = read_series(in_.response);
    if (!series) return series.status();
    std::vector<double> exposures;
    for (const ListedPicture& p : series->list) exposures.push_back(p.exposure_s * p.gain);
    const auto samples = photometry::choose_samples(series->pictures, exposures, dark_value_, photometry().saturation);
    if (!samples) return samples.status();
    Result<photometry::ResponseEstimate> found = photometry::solve_response(*samples);
    if (!found) return found.status();
    photometry().response = found->response;
    photometry().black_level = found->black_level;
    if (in_.dark.empty())
      run_.notes.push_back("response: the black level was taken from the input calibration; --dark measures it");
    compare_channels(*samples, *found);
    run_.response = std::move(*found);
    return {};
  }

  /// The calibration has one curve for all channels: adds a note if the channels differ.
  void compare_channels(const photometry::ResponseSamples& samples, const photometry::ResponseEstimate& common) {
    constexpr double kMinReportedChange = 0.01;
    for (int c = 0; c < 3; ++c) {
      const auto own = photometry::solve_response(samples, c);
      if (!own) continue;  // Too few samples of this channel.
      double largest = 0;
      for (int i = 0; i <= 64; ++i) {
        const double v = dark_value_ + (1 - dark_value_) * i / 64;
        largest = std::max(largest, std::abs(photometry::free_curve(*own, v) - photometry::free_curve(common, v)));
      }
      if (largest > kMinReportedChange)
        run_.notes.push_back(std::string("response: ") +
                             (c == 0   ? "red"
                              : c == 1 ? "green"
                                       : "blue") +
                             " alone differs by " + std::to_string(100 * largest) +
                             " % of full scale from the common curve");
    }
  }

  Status dark() {
    if (in_.dark.empty()) return {};
    const Result<photometry::DarkEstimate> found =
        photometry::solve_dark(dark_.pictures, photometry().response, dark_.list.front().gain);
    if (!found) return found.status();
    photometry().black_level = found->black_level;
    if (found->resolved)
      photometry().read_noise = found->read_noise;
    else
      run_.notes.push_back(
          "dark: the read noise is below the rounding; it stays as in the input calibration unless --flat measures it");
    if (found->outlier_share > 0.01) run_.notes.push_back("dark: more than 1 % of the pixels are hot or dead");
    run_.dark = *found;
    return {};
  }

  Status flat() {
    if (in_.flat.empty()) return {};
    Result<Series> series = read_series(in_.flat);
    if (!series) return series.status();
    std::vector<photometry::FlatPair> pairs;
    for (std::size_t i = 0; i < series->list.size(); i += 2) {
      const ListedPicture& a = series->list[i];
      if (i + 1 == series->list.size() || series->list[i + 1].exposure_s != a.exposure_s ||
          series->list[i + 1].gain != a.gain)
        return invalid(a.path + ": no second picture of the same exposure and gain follows it; flats come in pairs");
      pairs.push_back({std::move(series->pictures[i]), std::move(series->pictures[i + 1]), a.gain});
    }
    Result<std::vector<photometry::NoiseLevel>> levels = photometry::noise_levels(pairs, photometry());
    if (!levels) return levels.status();
    const Result<photometry::NoiseEstimate> found = photometry::solve_noise(*levels, run_.dark);
    if (!found) return found.status();
    photometry().read_noise = found->read_noise;
    photometry().shot_noise = found->shot_noise;
    run_.levels = std::move(*levels);
    run_.noise = *found;
    return {};
  }

  Status lamp() {
    if (in_.lamp.empty()) return {};
    if (std::holds_alternative<EquirectangularParameters>(lens_.model))
      return invalid("--lamp: an equirectangular picture has no lens axis, so it has no vignetting");
    const Result<std::vector<ListedPicture>> list = list_pictures(in_.lamp, in_.lens);
    if (!list) return list.status();
    const Result<std::map<std::string, double>> angles = read_angles(in_.lamp);
    if (!angles) return angles.status();
    const Result<photometry::LampFinder> finder = photometry::LampFinder::make(lens_);
    if (!finder) return finder.status();
    for (const ListedPicture& p : *list) {
      std::optional<double> angle;
      if (!angles->empty()) {
        const auto at = angles->find(p.file);
        if (at == angles->end()) return invalid(in_.lamp + "/angles.csv: no angle for " + p.file);
        angle = at->second;
      }
      const Result<Picture> picture = read_picture(p.path);
      if (!picture) return picture.status();
      const Result<photometry::LampObservation> seen = finder->find(*picture, p.exposure_s * p.gain, angle, p.path);
      if (!seen) return seen.status();
      run_.observations.push_back(*seen);
    }
    Result<photometry::VignettingEstimate> found = photometry::solve_vignetting(run_.observations, lens_.max_angle_rad);
    if (!found) return found.status();
    photometry().vignetting = found->vignetting;
    run_.vignetting = std::move(*found);
    return {};
  }

  Status grey() {
    if (in_.grey.empty()) return {};
    const Result<Picture> picture = read_picture(in_.grey);
    if (!picture) return picture.status();
    const Result<photometry::PatchMean> patch = photometry::patch_mean(*picture, in_.patch, photometry(), in_.grey);
    if (!patch) return patch.status();
    std::array<double, 3> light{1, 1, 1};
    if (in_.grey_xy) {
      const auto rgb = photometry::rgb_of_chromaticity((*in_.grey_xy)[0], (*in_.grey_xy)[1]);
      if (!rgb) return rgb.status();
      light = *rgb;
    }
    const Result<photometry::WhiteBalance> balance = photometry::solve_white_balance(*patch, light);
    if (!balance) return balance.status();
    photometry().white_balance = balance->factors;
    run_.white_balance = *balance;
    if (in_.nits || in_.lux) return scale(*patch);
    return {};
  }

  Status scale(const photometry::PatchMean& patch) {
    const auto reading = in_.nits ? photometry::luminance_reading(*in_.nits, in_.meter_deviation)
                                  : photometry::illuminance_reading(*in_.lux, in_.albedo, in_.meter_deviation);
    if (!reading) return reading.status();
    Result<photometry::PatchExposure> exposure = grey_exposure();
    if (!exposure) return exposure.status();
    // Vignetting averaged over the whole patch, because a large patch darkens towards its edge.
    const CameraModel model(lens_);
    double sum = 0;
    for (int y = in_.patch.y; y < in_.patch.y + in_.patch.height; ++y)
      for (int x = in_.patch.x; x < in_.patch.x + in_.patch.width; ++x) {
        const auto d = model.unproject({static_cast<double>(x), static_cast<double>(y)});
        if (!d) return invalid(in_.grey + ": the patch extends beyond the field of view");
        sum += vignetting(photometry(), std::atan2(std::hypot(d->x, d->y), d->z));
      }
    exposure->vignetting = sum / (static_cast<double>(in_.patch.width) * in_.patch.height);
    const auto found = photometry::solve_absolute_scale(patch, photometry().white_balance, *exposure, *reading);
    if (!found) return found.status();
    run_.rig.nits_per_unit = found->nits_per_unit;
    run_.scale = *found;
    return {};
  }

  [[nodiscard]] Result<photometry::PatchExposure> grey_exposure() const {
    photometry::PatchExposure out{in_.grey_exposure_s, in_.grey_gain > 0 ? in_.grey_gain : 1, 1};
    if (out.exposure_s > 0) return out;
    const fs::path path(in_.grey);
    const auto list = list_pictures(path.parent_path().empty() ? "." : path.parent_path().string(), in_.lens);
    if (list)
      for (const ListedPicture& p : *list)
        if (p.file == path.filename().string()) return photometry::PatchExposure{p.exposure_s, p.gain, 1};
    return invalid(in_.grey +
                   ": its exposure is not known; give --grey-exposure-s, or list it in the frames.csv beside it");
  }

  PhotometryRun& run_;
  const PhotometryInputs& in_;
  LensParameters& lens_;
  Series dark_;
  double dark_value_ = 0;
};

}  // namespace

Result<PhotometryRun> calibrate_photometry(const RigParameters& rig, const PhotometryInputs& inputs) {
  if (inputs.lens < 0 || static_cast<std::size_t>(inputs.lens) >= rig.lenses.size())
    return invalid("--lens " + std::to_string(inputs.lens) + ": the calibration has " +
                   std::to_string(rig.lenses.size()) + " (numbered from 0)");
  PhotometryRun out;
  out.rig = rig;
  out.lens = inputs.lens;
  if (Status s = Steps(out, inputs).run(); !s.ok()) return s;
  if (rig.nits_per_unit > 0 && !out.scale && (out.response || out.dark || out.vignetting || out.white_balance))
    out.notes.push_back(
        "nits_per_unit stays as in the input, although the photometry it depends on has changed; give --nits or --lux");
  if (Status s = out.rig.validate(); !s.ok())
    return Status(s.code(), "the result is not a valid calibration: " + s.message());
  return out;
}

}  // namespace lightwell::calibrate
