#include "ar_viewer/light_source.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/recording.hpp>

#include "core/descriptor_receiver.hpp"

namespace lightwell::viewer {
namespace {

constexpr Duration kFirstDescriptorTimeout{2'000'000'000};

class FixedLight final : public LightSource {
 public:
  explicit FixedLight(Descriptor descriptor) : lighting_(Lighting::of(std::move(descriptor))) {}
  [[nodiscard]] Lighting next() override { return lighting_; }

 private:
  Lighting lighting_;
};

class LiveLight final : public LightSource {
 public:
  explicit LiveLight(Probe probe) : probe_(std::move(probe)) {}
  [[nodiscard]] Lighting next() override { return probe_.latest(); }

 private:
  Probe probe_;
};

/// One descriptor a frame, whatever the time: the same pictures in every run.
class RecordedLight final : public LightSource {
 public:
  explicit RecordedLight(RecordReader reader) : reader_(std::move(reader)), receiver_(ProbeOptions{}) {
    receiver_.describe({});
  }

  [[nodiscard]] Lighting next() override {
    while (reader_.next(record_)) {
      if (record_.message != RecordedMessage::descriptor || record_.payload.size() > kMaxDescriptorBytes) continue;
      time_ = HostTime{monotonic_now_ns()};
      receiver_.reset_sequence();
      receiver_.receive(record_.payload, time_, [this](const CaptureTime&) { return core::MappedTime{time_, {}}; });
      break;
    }
    return receiver_.latest(time_);
  }

 private:
  RecordReader reader_;
  Record record_;
  core::DescriptorReceiver receiver_;
  HostTime time_;
};

Result<std::unique_ptr<LightSource>> open_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    return Status(StatusCode::not_found, path + ": the light's file cannot be opened; an address begins with SCHEME:");
  Result<RecordReader> recording = RecordReader::open(path);
  if (recording.ok()) {
    if (recording->header().kind == RecordingKind::frames)
      return invalid_argument(path + ": a recording of frames; record descriptors with `lightwell record`");
    return std::unique_ptr<LightSource>(std::make_unique<RecordedLight>(std::move(*recording)));
  }
  std::error_code error;
  if (std::filesystem::file_size(path, error) > kMaxDescriptorBytes || error)
    return Status(StatusCode::resource_exhausted, path + ": neither a recording nor a descriptor, which has at most " +
                                                      std::to_string(kMaxDescriptorBytes) + " bytes");
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  Result<Descriptor> descriptor = decode_descriptor(std::as_bytes(std::span(bytes)));
  if (!descriptor.ok()) return descriptor.status().in(path + ": neither a recording nor a descriptor");
  return std::unique_ptr<LightSource>(std::make_unique<FixedLight>(std::move(*descriptor)));
}

Result<std::unique_ptr<LightSource>> open_probe(const std::string& uri) {
  Result<Probe> probe = Probe::connect(uri);
  if (!probe.ok()) return probe.status();  // It names the address.
  const Result<Lighting> first = probe->wait_for_next(std::nullopt, kFirstDescriptorTimeout);
  if (!first.ok()) return first.status().in(uri);
  return std::unique_ptr<LightSource>(std::make_unique<LiveLight>(std::move(*probe)));
}

}  // namespace

Result<std::unique_ptr<LightSource>> open_light_source(const LightDescription& description) {
  if (const auto* uri = std::get_if<LightUri>(&description)) return open_probe(uri->uri);
  if (const auto* file = std::get_if<LightFile>(&description)) return open_file(file->path);
  return std::unique_ptr<LightSource>(std::make_unique<FixedLight>(std::get<LightValues>(description).descriptor));
}

}  // namespace lightwell::viewer
