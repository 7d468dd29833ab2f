#include "tools/lightwell_calibrate/photometry_input.hpp"

#include <filesystem>
#include <fstream>
#include <numbers>

#include <lightwell/text.hpp>

#include "camera/backends/replay/frame_list.hpp"
#include "imaging/image_file.hpp"

namespace lightwell::calibrate {
namespace {

namespace fs = std::filesystem;

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, what}; }

}  // namespace

Result<std::vector<ListedPicture>> list_pictures(const std::string& folder, const PictureKind& kind) {
  const Result<std::vector<replay::ListedFrame>> frames = replay::load_frame_list(folder);
  if (!frames) return frames.status();
  std::vector<ListedPicture> out;
  for (const replay::ListedFrame& frame : *frames) {
    const auto lens = static_cast<std::size_t>(kind.lens);
    if (frame.files.size() > 1 && lens >= frame.files.size())
      return invalid((fs::path(folder) / "frames.csv").string() + ": no picture of lens " + std::to_string(kind.lens) +
                     "; see --lens");
    const std::string& name = frame.files.size() > 1 ? frame.files[lens] : frame.files.front();
    out.push_back({(fs::path(folder) / name).string(), name, frame.info.exposure_s, frame.info.gain});
  }
  return out;
}

Result<photometry::Picture> read_picture(const std::string& path, const PictureKind& kind) {
  const Result<Image> image = read_image(path);
  if (!image) return image.status();
  if (image->width != kind.width || image->height != kind.height)
    return invalid(path + ": it has " + std::to_string(image->width) + "x" + std::to_string(image->height) +
                   " pixels, the calibration of lens " + std::to_string(kind.lens) + " is for " +
                   std::to_string(kind.width) + "x" + std::to_string(kind.height));
  const View view{kind.lens, image->format, image->width, image->height, image->stride(), image->data};
  return photometry::picture_of(view, path, kind.float_levels);
}

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

}  // namespace lightwell::calibrate
