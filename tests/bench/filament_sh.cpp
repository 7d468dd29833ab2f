#include "bench/filament_sh.hpp"

#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <filament/Engine.h>
#include <ibl/Cubemap.h>
#include <ibl/CubemapSH.h>
#include <ibl/CubemapUtils.h>
#include <ibl/Image.h>

namespace lightwell::bench {

namespace {

constexpr std::size_t kFace = 256;  // cmgen's default
constexpr std::size_t kBands = 3;

/// Pins the calling thread to one processor during its lifetime; threads started by it inherit that.
class OneProcessor {
 public:
  OneProcessor() {
    cpu_set_t one;
    if (pthread_getaffinity_np(pthread_self(), sizeof before_, &before_) != 0) return;
    CPU_ZERO(&one);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (!CPU_ISSET(cpu, &before_)) continue;
      CPU_SET(cpu, &one);
      break;
    }
    set_ = pthread_setaffinity_np(pthread_self(), sizeof one, &one) == 0;
  }
  ~OneProcessor() {
    if (set_) pthread_setaffinity_np(pthread_self(), sizeof before_, &before_);
  }
  OneProcessor(const OneProcessor&) = delete;
  OneProcessor& operator=(const OneProcessor&) = delete;

 private:
  cpu_set_t before_{};
  bool set_ = false;
};

/// Redirects stdout while Filament prints its banner, because the program's stdout is parsed.
class QuietStdout {
 public:
  QuietStdout() {
    std::fflush(stdout);
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere < 0) return;
    before_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
    if (before_ >= 0) dup2(nowhere, STDOUT_FILENO);
    close(nowhere);
  }
  ~QuietStdout() {
    if (before_ < 0) return;
    std::fflush(stdout);
    dup2(before_, STDOUT_FILENO);
    close(before_);
  }
  QuietStdout(const QuietStdout&) = delete;
  QuietStdout& operator=(const QuietStdout&) = delete;

 private:
  int before_ = -1;
};

}  // namespace

struct FilamentRoute::State {
  filament::Engine* engine = nullptr;
  filament::ibl::Image image;
};

bool FilamentRoute::available() { return true; }

FilamentRoute::FilamentRoute() : state_(std::make_unique<State>()) {
  const OneProcessor one;
  const QuietStdout quiet;
  state_->engine = filament::Engine::create(filament::Engine::Backend::NOOP);
}

FilamentRoute::~FilamentRoute() {
  const QuietStdout quiet;
  filament::Engine::destroy(&state_->engine);
}

void FilamentRoute::load(const EquirectImage& image) {
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  state_->image = filament::ibl::Image(width, height);
  for (std::size_t j = 0; j < height; ++j)
    std::memcpy(state_->image.getPixelRef(0, j), image.rgb.data() + 3 * width * j, 3 * width * sizeof(float));
}

FilamentSh FilamentRoute::run() {
  FilamentSh result;
  if (!state_->image.isValid()) return result;
  const OneProcessor one;
  utils::JobSystem& jobs = state_->engine->getJobSystem();
  const double start = seconds_now();
  filament::ibl::Image faces;
  filament::ibl::Cubemap cube = filament::ibl::CubemapUtils::create(faces, kFace);
  filament::ibl::CubemapUtils::equirectangularToCubemap(jobs, cube, state_->image);
  const double middle = seconds_now();
  const auto sh = filament::ibl::CubemapSH::computeSH(jobs, cube, kBands, false);
  const double end = seconds_now();
  for (std::size_t k = 0; k < result.radiance.size(); ++k) {
    const double sign = k >= 1 && k <= 3 ? -1 : 1;  // only band 1 is odd
    result.radiance[k] = {sign * sh[k].x, sign * sh[k].y, sign * sh[k].z};
  }
  result.cube_s = middle - start;
  result.sh_s = end - middle;
  return result;
}

}  // namespace lightwell::bench
