#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include <lightwell/bytes.hpp>
#include <lightwell/recording.hpp>

#include "lightwell/v1/recording.pb.h"

namespace lightwell {
namespace {

// "LWREC", the container's version, and bytes that reveal a transfer in text mode (as in PNG).
constexpr std::array<unsigned char, 8> kMagic = {'L', 'W', 'R', 'E', 'C', 1, '\r', '\n'};
constexpr std::size_t kVersionAt = 5;
constexpr unsigned char kNewestVersion = 2;
constexpr std::size_t kRecordHead = 16;  // size u32, crc32c u32, time i64; little-endian.

std::uint32_t record_crc(const unsigned char* time, std::span<const std::byte> payload) {
  return crc32c(payload, crc32c(std::as_bytes(std::span(time, 8))));
}

/// The header as a message in binary form.
Result<std::string> encode_header(const RecordingHeader& h) {
  v1::RecordingHeader m;
  m.set_kind(static_cast<v1::RecordingHeader::Kind>(h.kind));
  m.set_probe_name(h.probe_name);
  m.set_version(h.version);
  if (h.calibration && !m.mutable_calibration()->ParseFromString(*h.calibration))
    return invalid_argument("the calibration is not a RigCalibration");
  return m.SerializeAsString();
}

/// Magic of a container. Version 2 has the layout of version 1; readers that know only version 1 refuse it by its
/// number, because they do not know the kind of recording.
std::array<unsigned char, 8> magic_of(RecordingKind kind) {
  std::array<unsigned char, 8> out = kMagic;
  if (kind == RecordingKind::descriptors_and_planes) out[kVersionAt] = 2;
  return out;
}

bool is_known(v1::RecordingHeader::Kind kind, unsigned char version) {
  return kind == v1::RecordingHeader::DESCRIPTORS || kind == v1::RecordingHeader::FRAMES ||
         (version >= 2 && kind == v1::RecordingHeader::DESCRIPTORS_AND_PLANES);
}

/// Replaces the payload, a MessageRecord, by the message in it.
void unwrap(Record& record) {
  v1::MessageRecord m;
  record.message = RecordedMessage::unknown;
  if (!m.ParseFromArray(record.payload.data(), static_cast<int>(record.payload.size())) ||
      m.message_case() == v1::MessageRecord::MESSAGE_NOT_SET)
    return;
  const bool plane = m.message_case() == v1::MessageRecord::kPlaneUpdate;
  record.message = plane ? RecordedMessage::plane : RecordedMessage::descriptor;
  const auto bytes = std::as_bytes(std::span(plane ? m.plane_update() : m.lighting_descriptor()));
  record.payload.assign(bytes.begin(), bytes.end());
}

Status write_error(const std::string& what) {
  const int error = errno;
  return {is_disk_full(error) ? StatusCode::resource_exhausted : StatusCode::data_loss,
          what + ": " + std::strerror(error)};
}

}  // namespace

Result<RecordWriter> RecordWriter::open(const std::string& path, const RecordingHeader& header) {
  const Result<std::string> message = encode_header(header);
  if (!message) return message.status();
  Result<FilePointer> file = open_for_update(path);
  if (!file) return file.status();
  std::fseek(file->get(), 0, SEEK_END);
  if (file_position(file->get()) != 0) {
    Result<RecordReader> old = RecordReader::read_header(std::move(*file), path);
    if (!old)
      return Status(StatusCode::failed_precondition,
                    path + " exists and is no recording; it is not changed, choose another name (" +
                        old.status().message() + ")");
    if (old->header().kind != header.kind)
      return Status(StatusCode::failed_precondition, path + " is a recording of another kind; choose another name");
    Record skipped;
    while (old->next(skipped)) {
    }
    if (const Status s = truncate_file(old->file_.get(), old->good_bytes()); !s.ok()) return s.in(path);
    return RecordWriter(std::move(old->file_), header.kind);
  }
  RecordWriter writer(std::move(*file), header.kind);
  const auto magic = magic_of(header.kind);
  if (std::fwrite(magic.data(), 1, magic.size(), writer.file_.get()) != magic.size()) return write_error(path);
  if (const Status s = writer.append_record(0, std::as_bytes(std::span(*message))); !s.ok()) return s.in(path);
  if (const Status s = writer.flush(); !s.ok()) return s.in(path);
  return writer;
}

Status RecordWriter::append(std::int64_t time_ns, std::span<const std::byte> payload, RecordedMessage message) {
  if (kind_ != RecordingKind::descriptors_and_planes)
    return message == RecordedMessage::descriptor ? append_record(time_ns, payload)
                                                  : invalid_argument("the recording was made for descriptors alone");
  v1::MessageRecord record;
  switch (message) {
    case RecordedMessage::descriptor:
      record.set_lighting_descriptor(payload.data(), payload.size());
      break;
    case RecordedMessage::plane:
      record.set_plane_update(payload.data(), payload.size());
      break;
    case RecordedMessage::unknown:
      return invalid_argument("a message that is neither a descriptor nor of a plane is not recorded");
  }
  const std::string bytes = record.SerializeAsString();
  return append_record(time_ns, std::as_bytes(std::span(bytes)));
}

Status RecordWriter::append_record(std::int64_t time_ns, std::span<const std::byte> payload) {
  if (payload.size() > kMaxRecordBytes) return invalid_argument("a record is larger than 1 GiB");
  unsigned char head[kRecordHead];
  put_le(head, static_cast<std::uint32_t>(payload.size()));
  put_le(head + 8, time_ns);
  put_le(head + 4, record_crc(head + 8, payload));
  if (std::fwrite(head, 1, sizeof head, file_.get()) != sizeof head ||
      // An empty span may have a null pointer, which fwrite() does not allow.
      (!payload.empty() && std::fwrite(payload.data(), 1, payload.size(), file_.get()) != payload.size()))
    return write_error("recording");
  return {};
}

Status RecordWriter::flush() { return std::fflush(file_.get()) == 0 ? Status() : write_error("recording"); }

std::uint64_t RecordWriter::bytes() const { return file_position(file_.get()); }

Result<RecordReader> RecordReader::open(const std::string& path) {
  Result<FilePointer> file = open_for_reading(path);
  if (!file) return file.status();
  return read_header(std::move(*file), path);
}

Result<RecordReader> RecordReader::read_header(FilePointer file, const std::string& path) {
  RecordReader reader;
  reader.file_ = std::move(file);
  std::FILE* f = reader.file_.get();
  std::fseek(f, 0, SEEK_END);
  reader.file_bytes_ = file_position(f);
  std::fseek(f, 0, SEEK_SET);
  std::array<unsigned char, 8> magic{};
  if (std::fread(magic.data(), 1, magic.size(), f) != magic.size() || std::memcmp(magic.data(), kMagic.data(), 5) != 0)
    return Status(StatusCode::data_loss, path + ": not a Lightwell recording (its first bytes are not \"LWREC\")");
  const unsigned char version = magic[kVersionAt];
  if (version < 1 || version > kNewestVersion)
    return Status(StatusCode::data_loss,
                  path + ": container version " + std::to_string(version) + " is not known; use a newer lightwell");
  if (magic[6] != kMagic[6] || magic[7] != kMagic[7])
    return Status(StatusCode::data_loss, path + ": damaged by a transfer in text mode; copy it again in binary mode");
  reader.good_bytes_ = kMagic.size();
  Record first;
  v1::RecordingHeader m;
  if (!reader.read(first) || !m.ParseFromArray(first.payload.data(), static_cast<int>(first.payload.size())) ||
      !is_known(m.kind(), version))
    return Status(StatusCode::data_loss, path + ": the recording's header is damaged");
  reader.header_.kind = static_cast<RecordingKind>(m.kind());
  reader.header_.probe_name = m.probe_name();
  reader.header_.version = m.version();
  if (m.has_calibration()) reader.header_.calibration = m.calibration().SerializeAsString();
  reader.first_ = reader.good_bytes_;
  return reader;
}

bool RecordReader::read(Record& out) {
  unsigned char head[kRecordHead];
  const auto torn = [this] {
    torn_bytes_ = file_bytes_ - good_bytes_;
    return false;
  };
  if (std::fread(head, 1, sizeof head, file_.get()) != sizeof head) return torn();
  const auto size = get_le<std::uint32_t>(head);
  // A damaged size must not cause an allocation larger than the file.
  if (size > kMaxRecordBytes || good_bytes_ + kRecordHead + size > file_bytes_) return torn();
  out.payload.resize(size);
  if (std::fread(out.payload.data(), 1, size, file_.get()) != size) return torn();
  if (record_crc(head + 8, out.payload) != get_le<std::uint32_t>(head + 4)) return torn();
  out.time_ns = get_le<std::int64_t>(head + 8);
  good_bytes_ += kRecordHead + size;
  return true;
}

bool RecordReader::next(Record& out) {
  if (torn_bytes_ != 0 || !read(out)) return false;
  out.message = RecordedMessage::descriptor;
  if (header_.kind == RecordingKind::descriptors_and_planes) unwrap(out);
  return true;
}

void RecordReader::rewind() {
  std::fseek(file_.get(), static_cast<long>(first_), SEEK_SET);
  good_bytes_ = first_;
  torn_bytes_ = 0;
}

}  // namespace lightwell
