#include "measure/relight_stream.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <unistd.h>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/relight.hpp>
#include <lightwell/relight_stream.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/process_memory.hpp"
#include "bench/thread_time.hpp"
#include "measure/output.hpp"
#include "measure/relight_renders.hpp"
#include "tools/command_line.hpp"

namespace lightwell::measure {
namespace {

constexpr int kColumns = 800, kRows = 600, kFrames = 12, kPasses = 3;
/// The basis lights at whose places the patterns are: those in front of the subject, +Z.
constexpr std::array<std::size_t, 4> kPatternLights = {0, 2, 3, 5};

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

RelightCamera camera() {
  RelightCamera out{kColumns, kRows, 1600, 0.5 * kColumns, 0.5 * kRows, {}};
  out.T_world_camera.translation = {0, 0, 6};
  return out;
}

/// A wavy surface that fills the picture.
std::vector<float> wavy_depth() {
  std::vector<float> out;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column)
      out.push_back(static_cast<float>(6 + 0.1 * std::sin(0.02 * column) * std::cos(0.03 * row)));
  return out;
}

/// Photographs whose content does not matter, of every code.
void write_frames(const std::string& path) {
  auto writer = require(BasisWriter::create(path, kColumns, kRows, kBasisLights));
  std::vector<std::vector<Radiance>> photographs(kBasisLights);
  for (std::size_t i = 0; i < kBasisLights; ++i)
    for (int p = 0; p < kColumns * kRows; ++p) {
      const auto v = static_cast<float>(0.5 + 0.5 * std::sin(0.013 * p + static_cast<double>(i)));
      photographs[i].push_back({v, v * v, 1 - v});
    }
  const std::vector<std::span<const Radiance>> frame(photographs.begin(), photographs.end());
  for (int f = 0; f < kFrames; ++f) require(writer.add(frame));
  require(writer.close());
}

/// Reads the same bytes in the same pieces and scales them: the least that relighting can take.
class ScalingReader {
 public:
  explicit ScalingReader(const std::string& path) : codes_(kPiece), sums_(kPiece) {
    file_.rdbuf()->pubsetbuf(nullptr, 0);
    file_.open(path, std::ios::binary);
  }
  double frame(std::uint64_t at, std::uint64_t bytes) {
    file_.seekg(static_cast<std::streamoff>(at));
    for (std::uint64_t done = 0; done < bytes; done += kPiece) {
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(kPiece, bytes - done));
      file_.read(reinterpret_cast<char*>(codes_.data()), static_cast<std::streamsize>(count));
      scale(codes_.data(), sums_.data(), count);
    }
    return static_cast<double>(sums_[0]);
  }

 private:
  static constexpr std::size_t kPiece = std::size_t{3} * kColumns * 16;
  static void scale(const std::uint8_t* __restrict codes, float* __restrict sums, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) sums[i] += 0.01F * static_cast<float>(codes[i]);
  }
  std::ifstream file_;
  std::vector<std::uint8_t> codes_;
  std::vector<float> sums_;
};

void drop_from_page_cache(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY);
  if (file < 0) return;
  (void)::fdatasync(file);
  (void)::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  (void)::close(file);
}

enum class Cache { page_cache, disk };

/// Median of the times of frames, ms.
double median_ms(Cache cache, const std::string& path, const std::function<void(std::size_t)>& frame) {
  std::vector<double> times;
  for (int pass = 0; pass < kPasses; ++pass) {
    if (cache == Cache::disk) drop_from_page_cache(path);
    for (std::size_t f = 0; f < kFrames; ++f) {
      const double start = seconds();
      frame(f);
      times.push_back(1e3 * (seconds() - start));
    }
  }
  std::ranges::nth_element(times, times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2));
  return times[times.size() / 2];
}

}  // namespace

void measure_relight_stream(const std::string& folder) {
  const std::string path =
      (folder.empty() ? std::filesystem::temp_directory_path().string() : folder) + "/performance.lwrb";
  write_frames(path);
  bench::PeakMemory memory;
  std::vector<std::vector<RgbFactor>> pictures(kPatternLights.size());
  std::vector<PatternLight> patterns;
  const auto basis = basis_lights();
  for (std::size_t k = 0; k < kPatternLights.size(); ++k) {
    PatternCase pattern = pattern_cases()[k % 2];
    pattern.light.position = traced_basis()[kPatternLights[k]].position;
    patterns.push_back(pattern_light(pattern, pictures[k]));
  }
  const std::vector<RgbFactor> weights(kBasisLights, RgbFactor{0.01F, 0.02F, 0.03F});
  AlphaMaps alpha;
  double alpha_ms = std::numeric_limits<double>::infinity();
  std::optional<BasisReader> reader;
  std::vector<Radiance> out;
  memory.measure([&] {
    const RelightSubject subject = require(RelightSubject::from_depth(camera(), wavy_depth(), {}));
    for (int pass = 0; pass < kPasses; ++pass) {
      const double start = bench::thread_time_ms();
      (void)require(alpha.compute(subject, basis, patterns, weights));
      alpha_ms = std::min(alpha_ms, bench::thread_time_ms() - start);
    }
    reader = require(BasisReader::open(path));
    out.resize(camera().pixels());
    require(reader->relight(alpha, 0, out));
  });
  const std::uint64_t bytes = std::uint64_t{kBasisLights} * kColumns * kRows * 3;
  const double memcpy_gb_s = bench::memcpy_speed(std::size_t{1} << 23).gigabytes_per_s;
  for (const Cache cache : {Cache::page_cache, Cache::disk}) {
    ScalingReader scaling(path);
    nlohmann::ordered_json line;
    line["part"] = "stream";
    line["cache"] = cache == Cache::page_cache ? "in the page cache" : "not in the page cache";
    line["columns"] = kColumns;
    line["rows"] = kRows;
    line["basis"] = kBasisLights;
    line["patterns"] = patterns.size();
    line["frame_mb"] = static_cast<double>(bytes) / 1e6;
    line["frame_ms"] = median_ms(cache, path, [&](std::size_t f) { require(reader->relight(alpha, f, out)); });
    line["scale_ms"] = median_ms(cache, path, [&](std::size_t f) { (void)scaling.frame(f * bytes, bytes); });
    line["alpha_ms"] = alpha_ms;
    line["resident_mb"] = memory.growth_mb();
    line["memcpy_gb_s"] = memcpy_gb_s;
    print_line(line);
  }
  std::filesystem::remove(path);
}

}  // namespace lightwell::measure
