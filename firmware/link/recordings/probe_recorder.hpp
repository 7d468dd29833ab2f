// Recordings of what the links send, in a folder of the probe, started and stopped by clients.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/recording.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

#include "link/link.hpp"
#include "link/token_bucket.hpp"

namespace lightwell {

/// Records descriptors, and planes if the header says so, as the links send them. One thread does all work on files.
/// publish() never waits for the disk: a full queue loses the message and counts it. Descriptors are stored byte for
/// byte, with the time at which they were published.
class ProbeRecorder final : public MessageSink {
 public:
  /// `config` is valid. `header.kind`: descriptors, or descriptors_and_planes.
  ProbeRecorder(RecordingsConfig config, RecordingHeader header);
  /// Ends the recording and the thread. No publish() may be in progress.
  ~ProbeRecorder() override;

  /// Whether a recording could be started now. failed_precondition: the folder is missing or cannot be written.
  /// resource_exhausted: a limit of the configuration. Blocks as long as the disk. The texts name no path, because
  /// clients receive them.
  [[nodiscard]] Status check_folder() const;

  /// Commands::control_recording().
  [[nodiscard]] Result<RecordingStatus> control(RecordingAction action);
  [[nodiscard]] RecordingStatus status() const;

  // From one thread.
  void publish(const EncodedDescriptor& descriptor) override;
  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) override;

 private:
  /// Either a descriptor or the messages of a plane.
  struct Message {
    std::int64_t time_ns = 0;
    EncodedDescriptor descriptor;
    std::shared_ptr<const EncodedPlane> plane;
    bool whole_plane = false;
  };
  struct Request {
    RecordingAction action;
    std::optional<Status> outcome;
  };
  /// What the folder holds.
  struct FolderContent {
    std::uint64_t bytes = 0;
    std::uint32_t files = 0;
  };

  void enqueue(Message message);
  void run();
  [[nodiscard]] Result<FolderContent> survey() const;
  [[nodiscard]] Status execute(RecordingAction action);
  [[nodiscard]] Status start();
  [[nodiscard]] Result<std::string> unused_name();
  /// Writes the queue's messages, and checks the limits about once a second.
  void write_queue();
  [[nodiscard]] Status write(const Message& message);
  [[nodiscard]] Status append(std::int64_t time_ns, std::span<const std::byte> bytes, RecordedMessage kind);
  /// Detects a file that was removed and a disk that is nearly full.
  [[nodiscard]] Status check_file() const;
  void close_file(const std::string& end_reason);

  const RecordingsConfig config_;
  const RecordingHeader header_;

  // Used by the thread only.
  TokenBucket starts_;
  std::optional<RecordWriter> file_;
  std::string path_;
  std::uint64_t earlier_bytes_ = 0;  ///< Of all other recordings in the folder.
  std::uint64_t descriptors_ = 0;    ///< In the file.
  std::uint32_t number_ = 0;         ///< Of the last recording since the start.
  std::int64_t checked_ns_ = 0;
  std::vector<Message> writing_;

  /// Guards the members below; never held during work on files.
  mutable std::mutex mutex_;
  std::condition_variable work_, done_;
  std::vector<Message> queue_;
  std::shared_ptr<Request> request_;
  RecordingStatus status_;
  bool plane_is_whole_ = false;  ///< The recording has the plane as it was before the next update.
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace lightwell
