#include "measure/glossy_book.hpp"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include <lightwell/calibration.hpp>

#include "imaging/image_file.hpp"
#include "pose/tag_board.hpp"

namespace lightwell::measure {
namespace {

constexpr int kTags = 4;
constexpr double kInk = 0.04, kPaper = 0.8;  ///< Albedo, those of book_texture().

Status write_text(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  return file.flush() ? Status() : Status(StatusCode::unavailable, path + ": cannot be written");
}

}  // namespace

Result<TaggedBook> tagged_book(std::uint64_t seed) {
  constexpr TagFamily kFamily = TagFamily::tag36h11;
  const TagShape shape = shape_of(kFamily);
  TaggedBook out;
  out.albedo = reference::book_texture(seed, TaggedBook::kEdge);
  out.plane.name = "book with tags";
  out.plane.side_m = SpecularSequence::kPlane_m;
  out.plane.tag_size_m = shape.edge_cells * TaggedBook::kCell * TaggedBook::kTexel_m;
  const int size = shape.cells * TaggedBook::kCell, far = TaggedBook::kEdge - TaggedBook::kMargin - size;
  const double center = out.plane.side_m / 2 - (TaggedBook::kMargin + size / 2.0) * TaggedBook::kTexel_m;
  for (int id = 0; id < kTags; ++id) {
    const bool left = id % 2 == 0, top = id < 2;
    out.plane.tags.push_back({id, Pose{{}, {left ? -center : center, top ? center : -center, 0}}});
    const Result<TagBitmap> bitmap = tag_bitmap(kFamily, id);
    if (!bitmap) return bitmap.status();
    const int first_column = left ? TaggedBook::kMargin : far, first_row = top ? TaggedBook::kMargin : far;
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column)
        std::fill_n(out.albedo.rgb.begin() + 3 * ((first_row + row) * TaggedBook::kEdge + first_column + column), 3,
                    bitmap->is_dark(column / TaggedBook::kCell, row / TaggedBook::kCell) ? kInk : kPaper);
  }
  return out;
}

Result<SpecularSequenceOptions> book_sequence(int frames, int width, int height) {
  Result<SpecularSequenceOptions> out = sequence_options("living room 0.32");
  if (!out) return out;
  const Result<TaggedBook> book = tagged_book(out->seed);
  if (!book) return book.status();
  out->albedo = book->albedo;
  out->frames = frames;
  out->turns = 4;
  out->lowest_deg = 20, out->farthest_m = 0.4;
  out->width = width, out->height = height;
  out->focal_px = 560.0 / 640 * width;
  return out;
}

Status write_replay(const SpecularSequence& sequence, int frames, const GlossyPlane& plane, const std::string& folder,
                    double period_s, const std::function<void(int)>& progress) {
  std::string list = "file,exposure_s,time_s\n";
  for (int k = 0; k < std::max(1, 2 * frames - 2); ++k)
    list += std::to_string(replayed_frame(static_cast<std::uint64_t>(k), frames)) + ".png," +
            std::to_string(SpecularSequence::kExposure_s) + "," + std::to_string(k * period_s) + "\n";
  Status error = write_text(folder + "/frames.csv", list);
  if (error.ok()) error = write_text(folder + "/calibration.textproto", calibration_to_text(sequence.rig()));
  if (error.ok()) error = write_text(folder + "/book.textproto", glossy_plane_to_text(plane));
  if (!error.ok()) return error;

  std::atomic<int> next = 0;
  std::mutex mutex;  // For `error`, `written` and `progress`.
  int written = 0;
  const auto render = [&] {
    for (int k = next++; k < frames; k = next++) {
      const Shot shot = sequence.frame(k);
      const SpecularSequenceOptions& o = sequence.options();
      const Status s =
          write_png(folder + "/" + std::to_string(k) + ".png", {o.width, o.height, o.format, shot.pixels.front()});
      const std::lock_guard lock(mutex);
      if (!s.ok()) error = s, next = frames;
      if (progress) progress(++written);
    }
  };
  std::vector<std::jthread> threads(std::max(1U, std::thread::hardware_concurrency()));
  for (std::jthread& t : threads) t = std::jthread(render);
  threads.clear();
  return error;
}

}  // namespace lightwell::measure
