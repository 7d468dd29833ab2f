#include "tools/lightwell_calibrate/photometry_steps.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include <lightwell/files.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"
#include "camera/backends/replay/source.hpp"
#include "imaging/csv.hpp"
#include "tools/command_line.hpp"
#include "tools/lens_image.hpp"

namespace lightwell::calibrate {
namespace {

namespace fs = std::filesystem;
using photometry::Picture;

struct ListedPicture {
  std::string path, file;  ///< `file`: the name in the list.
  double exposure_s = 1, gain = 1;
};

/// Reads FOLDER/frames.csv (camera/backends/replay/source.hpp): of each frame the picture of the lens, or the only one.
std::vector<ListedPicture> list_pictures(const std::string& folder, int lens) {
  std::vector<ListedPicture> out;
  for (const replay::ListedFrame& frame : require(replay::load_frame_list(folder))) {
    const std::size_t index = frame.files.size() > 1 ? static_cast<std::size_t>(lens) : 0;
    if (index >= frame.files.size())
      refuse((fs::path(folder) / "frames.csv").string() + formatted(": no picture of lens %d; see --lens", lens));
    const std::string& name = frame.files[index];
    out.push_back({(fs::path(folder) / name).string(), name, frame.info.exposure_s, frame.info.gain});
  }
  return out;
}

/// Reads FOLDER/angles.csv with the columns file and angle_deg: angles in rad by file. Empty if there is no such file.
std::map<std::string, double> read_angles(const std::string& folder) {
  std::map<std::string, double> out;
  const std::string path = (fs::path(folder) / "angles.csv").string();
  std::error_code error;
  if (!fs::exists(path, error)) return out;
  for (const CsvRow& row : require(parse_csv(require(read_text_file(path)), path, {"file", "angle_deg"}, 0))) {
    const std::string &file = row.cells.at("file"), &angle = row.cells.at("angle_deg");
    const std::optional<double> degrees = parse_number<double>(angle);
    if (!degrees || !(*degrees >= 0 && *degrees <= 180))
      refuse(row.place + "angle_deg '" + angle + "' is not an angle of 0 to 180");
    if (!out.emplace(file, *degrees * std::numbers::pi / 180).second) refuse(row.place + file + " is listed twice");
  }
  if (out.empty()) refuse(path + ": no angle is listed; without this file angles are those of the lens's geometry");
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

  void run() {
    dark_value_ = encoded(photometry().response, photometry().black_level);
    if (!in_.dark.empty()) read_dark();
    if (!in_.response.empty()) response();
    if (!in_.dark.empty()) dark();
    if (!in_.flat.empty()) flat();
    if (!in_.lamp.empty()) lamp();
    if (!in_.grey.empty()) grey();
  }

 private:
  /// PNG, JPEG, OpenEXR or HDR; floats are relative to full scale.
  [[nodiscard]] Picture read_picture(const std::string& path) const {
    const Image image = require(read_lens_image(path, run_.rig, in_.lens));
    return require(photometry::picture_of(view_of(image, in_.lens), path, in_.bits > 0 ? 1 << in_.bits : 0));
  }

  [[nodiscard]] Series read_series(const std::string& folder) const {
    Series out{list_pictures(folder, in_.lens), {}};
    for (const ListedPicture& p : out.list) out.pictures.push_back(read_picture(p.path));
    return out;
  }

  [[nodiscard]] PhotometricCalibration& photometry() { return lens_.photometry; }

  void read_dark() {
    dark_ = read_series(in_.dark);
    for (const ListedPicture& p : dark_.list)
      if (p.gain != dark_.list.front().gain)
        refuse(p.path + ": its gain differs from that of the first dark picture; take all with the same gain");
    dark_value_ = require(photometry::dark_value_of(dark_.pictures));
  }

  void response() {
    const Series series = read_series(in_.response);
    std::vector<double> exposures;
    for (const ListedPicture& p : series.list) exposures.push_back(p.exposure_s * p.gain);
    const photometry::ResponseSamples samples =
        require(photometry::choose_samples(series.pictures, exposures, dark_value_, photometry().saturation));
    run_.response = require(photometry::solve_response(samples));
    photometry().response = run_.response->response;
    photometry().black_level = run_.response->black_level;
    if (in_.dark.empty())
      run_.notes.push_back("response: the black level was taken from the input calibration; --dark measures it");
    compare_channels(samples, *run_.response);
  }

  /// The calibration has one curve for all channels: adds a note if the channels differ.
  void compare_channels(const photometry::ResponseSamples& samples, const photometry::ResponseEstimate& common) {
    constexpr double kMinReportedChange = 0.01;
    constexpr std::array kChannels = {"red", "green", "blue"};
    for (int c = 0; c < 3; ++c) {
      const auto own = photometry::solve_response(samples, c);
      if (!own) continue;  // Too few samples of this channel.
      double largest = 0;
      for (int i = 0; i <= 64; ++i) {
        const double v = dark_value_ + (1 - dark_value_) * i / 64;
        largest = std::max(largest, std::abs(photometry::free_curve(*own, v) - photometry::free_curve(common, v)));
      }
      if (largest > kMinReportedChange)
        run_.notes.push_back(formatted("response: %s alone differs by %f %% of full scale from the common curve",
                                       kChannels[static_cast<std::size_t>(c)], 100 * largest));
    }
  }

  void dark() {
    const photometry::DarkEstimate found =
        require(photometry::solve_dark(dark_.pictures, photometry().response, dark_.list.front().gain));
    photometry().black_level = found.black_level;
    if (found.resolved)
      photometry().read_noise = found.read_noise;
    else
      run_.notes.push_back(
          "dark: the read noise is below the rounding; it stays as in the input calibration unless --flat measures it");
    if (found.outlier_share > 0.01) run_.notes.push_back("dark: more than 1 % of the pixels are hot or dead");
    run_.dark = found;
  }

  void flat() {
    Series series = read_series(in_.flat);
    std::vector<photometry::FlatPair> pairs;
    for (std::size_t i = 0; i < series.list.size(); i += 2) {
      const ListedPicture& a = series.list[i];
      if (i + 1 == series.list.size() || series.list[i + 1].exposure_s != a.exposure_s ||
          series.list[i + 1].gain != a.gain)
        refuse(a.path + ": no second picture of the same exposure and gain follows it; flats come in pairs");
      pairs.push_back({std::move(series.pictures[i]), std::move(series.pictures[i + 1]), a.gain});
    }
    run_.levels = require(photometry::noise_levels(pairs, photometry()));
    run_.noise = require(photometry::solve_noise(run_.levels, run_.dark));
    photometry().read_noise = run_.noise->read_noise;
    photometry().shot_noise = run_.noise->shot_noise;
  }

  void lamp() {
    if (std::holds_alternative<EquirectangularParameters>(lens_.model))
      refuse("--lamp: an equirectangular picture has no lens axis, so it has no vignetting");
    const std::vector<ListedPicture> list = list_pictures(in_.lamp, in_.lens);
    const std::map<std::string, double> angles = read_angles(in_.lamp);
    const photometry::LampFinder finder = require(photometry::LampFinder::make(lens_));
    for (const ListedPicture& p : list) {
      std::optional<double> angle;
      if (!angles.empty()) {
        const auto at = angles.find(p.file);
        if (at == angles.end()) refuse(in_.lamp + "/angles.csv: no angle for " + p.file);
        angle = at->second;
      }
      run_.observations.push_back(require(finder.find(read_picture(p.path), p.exposure_s * p.gain, angle, p.path)));
    }
    run_.vignetting = require(photometry::solve_vignetting(run_.observations, lens_.max_angle_rad));
    photometry().vignetting = run_.vignetting->vignetting;
  }

  void grey() {
    const photometry::PatchMean patch =
        require(photometry::patch_mean(read_picture(in_.grey), in_.patch, photometry(), in_.grey));
    std::array<double, 3> light{1, 1, 1};
    if (in_.grey_xy) light = require(photometry::rgb_of_chromaticity((*in_.grey_xy)[0], (*in_.grey_xy)[1]));
    run_.white_balance = require(photometry::solve_white_balance(patch, light));
    photometry().white_balance = run_.white_balance->factors;
    if (in_.nits || in_.lux) scale(patch);
  }

  void scale(const photometry::PatchMean& patch) {
    const auto reading = require(in_.nits ? photometry::luminance_reading(*in_.nits, in_.meter_deviation)
                                          : photometry::illuminance_reading(*in_.lux, in_.albedo, in_.meter_deviation));
    photometry::PatchExposure exposure = grey_exposure();
    // Vignetting averaged over the whole patch, because a large patch darkens towards its edge.
    const CameraModel model(lens_);
    double sum = 0;
    for (int y = in_.patch.y; y < in_.patch.y + in_.patch.height; ++y)
      for (int x = in_.patch.x; x < in_.patch.x + in_.patch.width; ++x) {
        const auto d = model.unproject({static_cast<double>(x), static_cast<double>(y)});
        if (!d) refuse(in_.grey + ": the patch extends beyond the field of view");
        sum += vignetting(photometry(), std::atan2(std::hypot(d->x, d->y), d->z));
      }
    exposure.vignetting = sum / (static_cast<double>(in_.patch.width) * in_.patch.height);
    run_.scale = require(photometry::solve_absolute_scale(patch, photometry().white_balance, exposure, reading));
    run_.rig.nits_per_unit = run_.scale->nits_per_unit;
  }

  [[nodiscard]] photometry::PatchExposure grey_exposure() const {
    if (in_.grey_exposure_s > 0) return {in_.grey_exposure_s, in_.grey_gain > 0 ? in_.grey_gain : 1, 1};
    const fs::path path(in_.grey);
    try {
      for (const ListedPicture& p :
           list_pictures(path.parent_path().empty() ? "." : path.parent_path().string(), in_.lens))
        if (p.file == path.filename().string()) return {p.exposure_s, p.gain, 1};
    } catch (const InputError&) {
      // Without a list the exposure is not known, either.
    }
    refuse(in_.grey + ": its exposure is not known; give --grey-exposure-s, or list it in the frames.csv beside it");
  }

  PhotometryRun& run_;
  const PhotometryInputs& in_;
  LensParameters& lens_;
  Series dark_;
  double dark_value_ = 0;
};

}  // namespace

PhotometryRun calibrate_photometry(const RigParameters& rig, const PhotometryInputs& inputs) {
  if (inputs.lens < 0 || static_cast<std::size_t>(inputs.lens) >= rig.lenses.size())
    refuse(formatted("--lens %d: the calibration has %zu (numbered from 0)", inputs.lens, rig.lenses.size()));
  PhotometryRun out;
  out.rig = rig;
  out.lens = inputs.lens;
  Steps(out, inputs).run();
  if (rig.nits_per_unit > 0 && !out.scale && (out.response || out.dark || out.vignetting || out.white_balance))
    out.notes.push_back(
        "nits_per_unit stays as in the input, although the photometry it depends on has changed; give --nits or --lux");
  require(out.rig.validate().in("the result is not a valid calibration"));
  return out;
}

}  // namespace lightwell::calibrate
