#include "camera/backends/libcamera/libcamera_backend.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "camera/backends/libcamera/camera_system.hpp"
#include "camera/backends/libcamera/lens.hpp"
#include "imaging/pixel_layout.hpp"

namespace lightwell {
namespace libcam {
namespace {

/// Number of queued requests: the number that libcamera's pipelines ask for. More would only delay new exposures.
constexpr int kDepth = 4;

Status failed(const std::string& what, int error) {
  const StatusCode code = error == -EBUSY || error == -ENODEV ? StatusCode::unavailable : StatusCode::internal;
  return {code, what + ": " + std::strerror(-error) + (error == -EBUSY ? "; another program has the camera" : "")};
}

/// The formats of a stream, with the configuration that contains them.
struct Offer {
  std::vector<SupportedFormat> formats;
  std::vector<::libcamera::PixelFormat> theirs;
  std::vector<::libcamera::StreamRole> roles;
};

Offer offer_of(::libcamera::Camera& camera) {
  Offer offer;
  for (const auto role : {::libcamera::StreamRole::Viewfinder, ::libcamera::StreamRole::Raw}) {
    const auto configuration = configuration_for(camera, role);
    if (!configuration || configuration->empty()) continue;
    for (const ::libcamera::PixelFormat& format : configuration->at(0).formats().pixelformats()) {
      if (std::find(offer.theirs.begin(), offer.theirs.end(), format) != offer.theirs.end()) continue;
      offer.formats.push_back({format.fourcc(), format.modifier(), format.toString()});
      offer.theirs.push_back(format);
      offer.roles.push_back(role);
    }
  }
  return offer;
}

SupportedControls controls_of(const ::libcamera::ControlInfoMap& map) {
  namespace controls = ::libcamera::controls;
  SupportedControls offered;
  offered.manual_exposure = offers_manual_exposure(map);
  offered.manual_white_balance = offers(map, controls::AwbEnable);
  offered.manual_focus = offers(map, controls::AfMode);
  offered.exposure_us = range_of(map, controls::ExposureTime);
  offered.gain = range_of(map, controls::AnalogueGain);
  offered.colour_gain = range_of(map, controls::ColourGains);
  offered.duration_us = range_of(map, controls::FrameDurationLimits);
  return offered;
}

/// Colour space of a PixelFormat (lightwell/pixel.hpp).
::libcamera::ColorSpace color_space_for(PixelFormat format) {
  if (is_bayer(format)) return ::libcamera::ColorSpace::Raw;
  return pixel_layout(format).sampling == ColorSampling::rgb ? ::libcamera::ColorSpace::Srgb
                                                             : ::libcamera::ColorSpace::Smpte170m;
}

/// Whether the colour space converts to RGB as specified in lightwell/pixel.hpp.
bool means_the_same(const std::optional<::libcamera::ColorSpace>& space, PixelFormat format) {
  if (pixel_layout(format).sampling != ColorSampling::ycbcr) return true;
  return space && space->ycbcrEncoding == ::libcamera::ColorSpace::YcbcrEncoding::Rec601 &&
         space->range == ::libcamera::ColorSpace::Range::Limited;
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

/// A lens that is a camera of libcamera: acquisition, configuration, buffers and requests, one request per buffer.
class LensStream final : public Lens {
 public:
  /// `name`: an id or number, see CameraSystem::find().
  LensStream(std::string name, int lens, std::shared_ptr<Mailbox> mailbox)
      : name_(std::move(name)), lens_(lens), mailbox_(std::move(mailbox)) {}
  ~LensStream() override {
    release();
    if (system_) system_->unwatch(watcher_);
  }
  LensStream(const LensStream&) = delete;
  LensStream& operator=(const LensStream&) = delete;

  /// The first call returns not_found, with a list of all cameras, if there is no such camera.
  [[nodiscard]] Status acquire(const LibcameraOptions& options, int lendable) override {
    release();
    if (!system_) {
      if (Status s = CameraSystem::get().assign_to(system_); !s.ok()) return s;
      watcher_ = system_->watch([mailbox = mailbox_] { mailbox->cameras_changed(); });
    }
    std::shared_ptr<::libcamera::Camera> camera;
    if (settled_) {
      camera = system_->present(id_);
      if (!camera) return {StatusCode::unavailable, "libcamera: camera '" + id_ + "' is away: plug it in again"};
    } else {
      if (Status s = system_->find(name_).assign_to(camera); !s.ok()) return s;
    }
    if (const int error = camera->acquire(); error != 0) return failed("camera '" + camera->id() + "'", error);
    camera_ = std::move(camera);
    id_ = camera_->id();
    model_ = model_of(*camera_);
    Status s = configure(options, lendable + kDepth);
    if (s.ok()) s = allocate(lendable + kDepth);
    if (!s.ok()) {
      release();
      return {s.code(), "camera '" + id_ + "': " + s.message()};
    }
    ++session_;
    settled_ = true;
    // The slot holds a reference to the mailbox, because libcamera may still complete requests of an unplugged camera.
    camera_->requestCompleted.connect(
        mailbox_.get(), [mailbox = mailbox_, lens = lens_, session = session_](::libcamera::Request* request) {
          mailbox->complete({lens, session, static_cast<int>(request->cookie()), read_clocks()});
        });
    return {};
  }

  void release() override {
    if (!camera_) return;
    stop();
    // At this point no request is queued, or the camera is disconnected.
    camera_->requestCompleted.disconnect(mailbox_.get());
    requests_.clear();
    allocators_.clear();
    configuration_.reset();
    memory_.reset();
    idle_.clear();
    stream_ = nullptr;
    queued_ = 0;
    (void)camera_->release();
    camera_.reset();
  }

  [[nodiscard]] bool acquired() const override { return camera_ != nullptr; }
  [[nodiscard]] bool present() const override { return camera_ && system_->present(id_) == camera_; }

  [[nodiscard]] Status start() override {
    ::libcamera::ControlList list(camera_->controls());
    write_controls(list);
    requested_exposure_us_.reset();
    if (const int error = camera_->start(&list); error != 0)
      return failed("camera '" + id_ + "' does not start", error);
    return {};
  }

  void stop() override {
    if (!camera_) return;
    (void)camera_->stop();
    // stop() has returned all queued buffers.
    for (int i = 0; i < buffers(); ++i) {
      if (buffer_states_[static_cast<std::size_t>(i)] != BufferState::queued) continue;
      buffer_states_[static_cast<std::size_t>(i)] = BufferState::idle;
      idle_.push_back(i);
    }
    queued_ = 0;
  }

  [[nodiscard]] const std::string& id() const override { return id_; }
  [[nodiscard]] const std::string& model() const override { return model_; }
  [[nodiscard]] const PictureLayout& layout() const override { return layout_; }
  [[nodiscard]] const SelectedControls& controls() const override { return controls_; }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return notes_; }
  [[nodiscard]] std::shared_ptr<const PictureMemory> memory() const override { return memory_; }
  [[nodiscard]] int buffers() const override { return static_cast<int>(requests_.size()); }
  [[nodiscard]] int session() const override { return session_; }

  [[nodiscard]] bool full() const override { return queued_ == depth_ || idle_.empty(); }
  [[nodiscard]] bool queue(std::int32_t exposure_us) override {
    const int buffer = idle_.front();
    const auto b = static_cast<std::size_t>(buffer);
    ::libcamera::Request& request = *requests_[b];
    if (used_[b]) request.reuse(::libcamera::Request::ReuseBuffers);
    // Some pipelines ignore the controls of start(), so the first request contains all of them.
    if (!requested_exposure_us_) write_controls(request.controls());
    if (controls_.set_exposure && requested_exposure_us_ != exposure_us)
      request.controls().set(::libcamera::controls::ExposureTime, exposure_us);
    used_[b] = true;
    if (camera_->queueRequest(&request) != 0) return false;
    idle_.erase(idle_.begin());
    buffer_states_[b] = BufferState::queued;
    requested_exposure_us_ = exposure_us;
    ++queued_;
    return true;
  }

  [[nodiscard]] Picture collect(int buffer) override {
    namespace controls = ::libcamera::controls;
    const auto b = static_cast<std::size_t>(buffer);
    --queued_;
    buffer_states_[b] = BufferState::out;
    memory_->begin_reading(buffer);
    ::libcamera::Request& request = *requests_[b];
    Picture picture;
    const ::libcamera::FrameBuffer* const frame = request.findBuffer(stream_);
    if (request.status() != ::libcamera::Request::RequestComplete || frame == nullptr) return picture;
    const ::libcamera::FrameMetadata& about = frame->metadata();
    std::size_t bytes = 0;
    for (const ::libcamera::FrameMetadata::Plane& plane : about.planes()) bytes += plane.bytesused;
    picture.good = about.status == ::libcamera::FrameMetadata::FrameSuccess &&
                   bytes >= picture_bytes(layout_.format, packed_stride(layout_.format, layout_.width), layout_.height);
    picture.sequence = about.sequence;
    const auto& metadata = request.metadata();
    const auto stamp = metadata.get(controls::SensorTimestamp);
    picture.timestamp_ns = stamp ? *stamp : static_cast<std::int64_t>(about.timestamp);
    if (const auto us = metadata.get(controls::ExposureTime); us && *us > 0) picture.exposure_s = 1e-6 * *us;
    if (const auto gain = metadata.get(controls::AnalogueGain); gain && *gain > 0)
      picture.gain = static_cast<double>(*gain);
    return picture;
  }

  void make_idle(int buffer) override {
    memory_->end_reading(buffer);
    buffer_states_[static_cast<std::size_t>(buffer)] = BufferState::idle;
    idle_.push_back(buffer);
  }

 private:
  [[nodiscard]] Status configure(const LibcameraOptions& options, int buffers_wanted) {
    const Offer offer = offer_of(*camera_);
    const Result<std::size_t> choice = choose_format(offer.formats, settled_ ? layout_.format : options.format);
    if (!choice) return choice.status();
    const PixelFormat format = *format_of(offer.formats[*choice].fourcc, offer.formats[*choice].modifier);
    configuration_ = configuration_for(*camera_, offer.roles[*choice]);
    if (!configuration_ || configuration_->empty())
      return {StatusCode::internal, "its stream disappeared during configuration: try again"};
    ::libcamera::StreamConfiguration& wanted = configuration_->at(0);
    wanted.pixelFormat = offer.theirs[*choice];
    wanted.size = {static_cast<unsigned>(options.width), static_cast<unsigned>(options.height)};
    wanted.bufferCount = static_cast<unsigned>(buffers_wanted);
    wanted.colorSpace = color_space_for(format);
    if (configuration_->validate() == ::libcamera::CameraConfiguration::Invalid || configuration_->size() != 1)
      return {StatusCode::failed_precondition, "it cannot give " + size_text(options.width, options.height) + " " +
                                                   std::string(to_string(format)) +
                                                   ": ask for another size or format="};
    const ::libcamera::StreamConfiguration& got = configuration_->at(0);
    const PictureLayout layout{format, static_cast<int>(got.size.width), static_cast<int>(got.size.height), got.stride};
    if (got.pixelFormat != offer.theirs[*choice])
      return {StatusCode::failed_precondition, "it gives " + got.pixelFormat.toString() + " in place of " +
                                                   std::string(to_string(format)) + " at this size: ask for another"};
    if (!size_fits(format, layout.width, layout.height))
      return {StatusCode::failed_precondition, "pictures of " + size_text(layout.width, layout.height) + " " +
                                                   std::string(to_string(format)) +
                                                   " have a fractional number of chroma pixels: request another size"};
    if (layout.stride < packed_stride(format, layout.width) || layout.stride % pixel_layout(format).sample_bytes != 0)
      return {StatusCode::internal, "rows of " + std::to_string(layout.stride) + " bytes cannot hold the picture"};
    if (settled_ && (layout.width != layout_.width || layout.height != layout_.height))
      return {StatusCode::failed_precondition, "it came back with pictures of " +
                                                   size_text(layout.width, layout.height) + ", and was opened with " +
                                                   size_text(layout_.width, layout_.height)};
    if (const int error = camera_->configure(configuration_.get()); error != 0) return failed("configure", error);
    stream_ = configuration_->at(0).stream();
    depth_ = std::clamp(static_cast<int>(configuration_->at(0).bufferCount), 1, kDepth);

    // After configure(), because the ranges may depend on the configuration.
    Result<SelectedControls> controls = choose_controls(controls_of(camera_->controls()), options);
    if (!controls) return controls.status();
    if (!settled_) {
      controls_ = std::move(*controls);
      notes_ = controls_.notes;
      if (layout.width != options.width || layout.height != options.height)
        notes_.push_back("pictures of " + size_text(layout.width, layout.height) + " in place of " +
                         size_text(options.width, options.height));
      if (!means_the_same(configuration_->at(0).colorSpace, format))
        notes_.push_back("colours come as " + ::libcamera::ColorSpace::toString(configuration_->at(0).colorSpace) +
                         " and are read as BT.601 of limited range: calibrate with this camera, or use format=rgb8");
    }
    layout_ = layout;
    return {};
  }

  [[nodiscard]] Status allocate(int buffers_wanted) {
    auto memory = std::make_shared<BufferMemory>();
    while (buffers() < buffers_wanted) {
      auto allocator = std::make_unique<::libcamera::FrameBufferAllocator>(camera_);
      if (const int got = allocator->allocate(stream_); got <= 0)
        return {StatusCode::resource_exhausted, "it has memory for " + std::to_string(buffers()) + " buffers, and " +
                                                    std::to_string(buffers_wanted) +
                                                    " are needed: use smaller pictures or fewer exposures"};
      for (const std::unique_ptr<::libcamera::FrameBuffer>& buffer : allocator->buffers(stream_)) {
        std::unique_ptr<::libcamera::Request> request = camera_->createRequest(requests_.size());
        if (!request) return {StatusCode::internal, "a request could not be created"};
        if (const int error = request->addBuffer(stream_, buffer.get()); error != 0) return failed("addBuffer", error);
        if (Status s = memory->add(*buffer, layout_); !s.ok()) return s;
        requests_.push_back(std::move(request));
      }
      allocators_.push_back(std::move(allocator));
    }
    memory_ = std::move(memory);
    idle_.clear();
    idle_.reserve(requests_.size());
    for (int i = 0; i < buffers(); ++i) idle_.push_back(i);
    used_.assign(requests_.size(), false);
    buffer_states_.assign(requests_.size(), BufferState::idle);
    return {};
  }

  void write_controls(::libcamera::ControlList& list) const {
    namespace controls = ::libcamera::controls;
    if (controls_.manual_exposure) set_manual_exposure(camera_->controls(), list);
    if (controls_.manual_white_balance) list.set(controls::AwbEnable, false);
    if (controls_.manual_focus) list.set(controls::AfMode, static_cast<std::int32_t>(controls::AfModeManual));
    if (controls_.set_exposure) list.set(controls::ExposureTime, controls_.exposure_us.front());
    if (controls_.gain) list.set(controls::AnalogueGain, *controls_.gain);
    if (controls_.colour_gains)
      list.set(controls::ColourGains, ::libcamera::Span<const float, 2>(*controls_.colour_gains));
    if (controls_.duration_us) {
      const std::array<std::int64_t, 2> limits{*controls_.duration_us, *controls_.duration_us};
      list.set(controls::FrameDurationLimits, ::libcamera::Span<const std::int64_t, 2>(limits));
    }
  }

  const std::string name_;
  const int lens_;
  const std::shared_ptr<Mailbox> mailbox_;
  std::shared_ptr<CameraSystem>
      system_;  ///< Set by the first acquire(); destroyed after all members that use the camera.
  int watcher_ = 0;
  std::shared_ptr<::libcamera::Camera> camera_;
  std::string id_, model_;  ///< Empty until the first acquire().
  std::unique_ptr<::libcamera::CameraConfiguration> configuration_;
  ::libcamera::Stream* stream_ = nullptr;
  PictureLayout layout_;
  SelectedControls controls_;
  std::vector<std::string> notes_;
  bool settled_ = false;  ///< layout_ and controls_ are fixed by the first acquire().
  int session_ = 0;

  /// Several, because each allocates as many buffers as the pipeline chooses, for instance four.
  std::vector<std::unique_ptr<::libcamera::FrameBufferAllocator>> allocators_;
  std::vector<std::unique_ptr<::libcamera::Request>> requests_;  ///< One per buffer; the cookie is the buffer's index.
  std::shared_ptr<const BufferMemory> memory_;
  enum class BufferState : std::uint8_t { idle, queued, out };
  std::vector<BufferState> buffer_states_;  ///< By buffer.
  std::vector<int> idle_;                   ///< Oldest first.
  std::vector<bool> used_;                  ///< By buffer: the request needs reuse() before it is queued again.
  int queued_ = 0, depth_ = 0;
  std::optional<std::int32_t> requested_exposure_us_;  ///< Empty: no request since start().
};

}  // namespace
}  // namespace libcam

Result<std::unique_ptr<CameraBackend>> make_libcamera_backend(const CameraUri& uri, const CameraConfig& config) {
  using namespace libcam;
  Result<LibcameraOptions> options = parse_options(uri, config);
  if (!options) return options.status();
  auto mailbox = std::make_shared<Mailbox>();
  std::vector<std::unique_ptr<Lens>> lenses;
  for (const std::string& name : options->cameras)
    lenses.push_back(std::make_unique<LensStream>(name, static_cast<int>(lenses.size()), mailbox));
  return make_lens_backend(std::move(*options), std::move(lenses), std::move(mailbox));
}

}  // namespace lightwell
