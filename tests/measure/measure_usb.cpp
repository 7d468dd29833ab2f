// Overhead of the USB link's framing: writing, reading, and reading a damaged stream. One JSON object per line for
// tests/figures: figure, value.
//   measure_usb
#include <chrono>
#include <random>
#include <string>

#include <lightwell/framing.hpp>

#include "measure/output.hpp"

namespace {

using namespace lightwell;
using measure::print_figure;
using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::byte>;

/// Best time of five in seconds.
template <class Work>
double seconds(Work&& work) {
  double best = 1e9;
  for (int i = 0; i < 5; ++i) {
    const auto start = Clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return best;
}

Bytes stream_of(std::size_t payload, int frames) {
  FrameWriter writer(1);
  Bytes all, frame;
  const Bytes message(payload, std::byte{0x5A});
  for (int i = 0; i < frames; ++i) {
    if (!writer.write(FrameKind::descriptor, message, frame).ok()) return {};
    all.insert(all.end(), frame.begin(), frame.end());
  }
  return all;
}

/// Uses a new reader each time, because a reader rejects a repeated stream as a replay.
double read_seconds(const Bytes& stream, std::uint64_t& frames) {
  return seconds([&] {
    FrameReader reader;
    constexpr std::size_t kTransfer = 16 * 1024;
    for (std::size_t at = 0; at < stream.size(); at += kTransfer)
      reader.push(std::span(stream).subspan(at, std::min(kTransfer, stream.size() - at)), [](const LinkFrame&) {});
    frames = reader.counters().frames;
  });
}

}  // namespace

int main() {
  for (const std::size_t payload : {std::size_t{200}, std::size_t{27'000}, kMaxDescriptorBytes}) {
    const int count = static_cast<int>(40'000'000 / (payload + 200));
    const std::string of = " of " + std::to_string(payload) + " bytes, us";
    const double writing = seconds([&] {
      FrameWriter writer(1);
      Bytes frame;
      const Bytes message(payload, std::byte{0x5A});
      for (int i = 0; i < count; ++i)
        if (!writer.write(FrameKind::descriptor, message, frame).ok()) return;
    });
    print_figure("write a frame" + of, writing / count * 1e6);
    Bytes stream = stream_of(payload, count);
    std::uint64_t frames = 0;
    const double reading = read_seconds(stream, frames);
    if (frames != static_cast<std::uint64_t>(count)) return 1;
    print_figure("read a frame" + of, reading / count * 1e6);
    std::mt19937 random(1);
    for (std::size_t at = 0; at < stream.size(); at += 1 + random() % 20'000) stream[at] ^= std::byte{1};
    print_figure("read a stream with a flipped bit in every 10 kB, share of the time without",
                 read_seconds(stream, frames) / reading);
  }
}
