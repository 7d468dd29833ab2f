#include "tools/lightwell_calibrate/board_pictures.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"
#include "pose/grey_view.hpp"
#include "pose/tag_detector.hpp"
#include "tools/command_line.hpp"
#include "tools/lens_image.hpp"

namespace lightwell::calibrate {
namespace {

namespace fs = std::filesystem;
using calibration::BoardObservations;

std::vector<std::string> files_of(const std::vector<std::string>& paths) {
  std::vector<std::string> out;
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      out.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path, error)) {
      std::string end = entry.path().extension().string();
      std::transform(end.begin(), end.end(), end.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (end == ".png" || end == ".jpg" || end == ".jpeg") inside.push_back(entry.path().string());
    }
    if (error) throw InputError({StatusCode::not_found, path + ": " + error.message()});
    if (inside.empty()) throw InputError({StatusCode::not_found, path + ": no PNG or JPEG is in it"});
    std::sort(inside.begin(), inside.end());
    out.insert(out.end(), inside.begin(), inside.end());
  }
  return out;
}

std::vector<TagBoard> boards_of(const std::vector<std::string>& files) {
  std::vector<TagBoard> out;
  std::map<std::pair<TagFamily, int>, std::string> owners;
  for (const std::string& file : files) {
    const TagBoard& board = out.emplace_back(require(load_tag_board(file)));
    for (int id = board.first_id; id < board.first_id + board.tags(); ++id) {
      const auto [other, fresh] = owners.try_emplace({board.family, id}, file);
      if (!fresh)
        refuse(file + ": tag " + std::to_string(id) + " is on " + other->second +
               " as well; print boards with different tag numbers (--first-id)");
    }
  }
  return out;
}

}  // namespace

BoardObservations read_board_observations(const BoardPictures& in, const FirstPass* before, const Progress& progress) {
  const std::vector<TagBoard> boards = boards_of(in.boards);
  BoardObservations out;
  TagDetectorOptions options;
  std::set<TagFamily> families;
  for (std::size_t b = 0; b < boards.size(); ++b) {
    const TagBoard& board = boards[b];
    families.insert(board.family);
    out.boards.push_back({in.boards[b], {}, 4});
    for (int id = board.first_id; id < board.first_id + board.tags(); ++id)
      for (const Vec3d& corner : board.corners(id)) out.boards.back().points.push_back(corner);
  }
  options.families.assign(families.begin(), families.end());
  std::vector<std::vector<std::string>> files;
  std::set<std::string> names;
  std::size_t total = 0, done = 0;
  for (const auto& paths : in.lenses) {
    if (paths.empty()) continue;
    files.push_back(files_of(paths));
    total += files.back().size();
    for (const std::string& f : files.back()) names.insert(fs::path(f).stem().string());
  }
  std::size_t points = 0;
  for (const calibration::Board& b : out.boards) points += b.points.size();
  std::map<std::string, int> captures;
  for (const std::string& name : names) captures.emplace(name, static_cast<int>(captures.size()));

  GreyView grey;
  for (std::size_t lens = 0; lens < files.size(); ++lens) {
    PhotometricCalibration photometry;
    photometry.response.kind = ResponseCurve::Kind::srgb;
    if (lens < in.photometry.size()) photometry = in.photometry[lens];
    options.linear = linear_table(photometry, 256);
    TagDetector detector = require(TagDetector::make(options));
    std::string first;
    for (const std::string& file : files[lens]) {
      // All points were found and refined in the first pass, so a second one can add nothing.
      if (before != nullptr && (!before->rectify[lens] || before->seen.pictures[done].observations.size() == points)) {
        if (first.empty()) out.lenses.push_back(before->seen.lenses[lens]);
        first = file;
        out.pictures.push_back(before->seen.pictures[done]);
        progress(++done, total);
        continue;
      }
      const Image image = require(read_image(file));
      if (image.format != PixelFormat::rgb8)
        refuse(file + ": tags are detected in PNG and JPEG; this is a float image");
      if (first.empty()) {
        first = file;
        out.lenses.push_back({image.width, image.height});
      } else if (image.width != out.lenses[lens].width || image.height != out.lenses[lens].height) {
        refuse(file + formatted(" is %dx%d, ", image.width, image.height) + first +
               formatted(" is %dx%d; a lens is calibrated from pictures of one size", out.lenses[lens].width,
                         out.lenses[lens].height));
      }
      std::optional<CameraModel> camera;
      if (before != nullptr) camera.emplace(before->lenses[lens]);
      const auto detected = detector.detect(grey.of(view_of(image, 0)), camera ? &*camera : nullptr);
      require(detected.status().in(file));
      const std::vector<TagDetection>& tags = *detected;
      calibration::Picture picture;
      picture.name = file;
      picture.lens = static_cast<int>(lens);
      picture.capture = captures[fs::path(file).stem().string()];
      picture.time_s = in.rate_hz > 0 ? picture.capture / in.rate_hz : 0;
      for (const TagDetection& tag : tags) {
        // An id that occurs twice is a reflection or another board.
        if (!tag.refined || std::ranges::count_if(tags, [&](const TagDetection& o) {
                              return o.family == tag.family && o.id == tag.id;
                            }) > 1)
          continue;
        for (std::size_t b = 0; b < boards.size(); ++b) {
          if (!boards[b].holds(tag.family, tag.id)) continue;
          for (int k = 0; k < 4; ++k) {
            const PixelPosition& p = tag.corners[static_cast<std::size_t>(k)];
            if (p.x < 0 || p.y < 0 || p.x > image.width - 1 || p.y > image.height - 1) continue;
            picture.observations.push_back({static_cast<int>(b), 4 * (tag.id - boards[b].first_id) + k, p});
          }
        }
      }
      out.pictures.push_back(std::move(picture));
      progress(++done, total);
    }
  }
  return out;
}

}  // namespace lightwell::calibrate
