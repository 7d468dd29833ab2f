// lightwell/files.hpp by Windows.
#include <aclapi.h>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <io.h>
#include <memory>
#include <sddl.h>
#include <system_error>
#include <vector>
#include <windows.h>

#include <lightwell/deleter.hpp>
#include <lightwell/files.hpp>

namespace lightwell {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
constexpr int kAttempts = 100;

std::wstring wide(const std::string& path) { return path_of(path).wstring(); }

Status failed(const std::string& path, const char* what, DWORD error = ::GetLastError()) {
  const StatusCode code = error == ERROR_DISK_FULL || error == ERROR_HANDLE_DISK_FULL ? StatusCode::resource_exhausted
                          : error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND
                              ? StatusCode::not_found
                              : StatusCode::failed_precondition;
  return {code, path + ": " + what + ": " + std::system_category().message(static_cast<int>(error))};
}

Status refused_path(const std::string& path, const char* why) {
  return {StatusCode::failed_precondition, path + ": " + why};
}

struct CloseHandle {
  using pointer = HANDLE;
  void operator()(HANDLE handle) const {
    if (handle != INVALID_HANDLE_VALUE) ::CloseHandle(handle);
  }
};
using Handle = std::unique_ptr<void, CloseHandle>;
bool is_open(const Handle& handle) { return handle.get() != nullptr && handle.get() != INVALID_HANDLE_VALUE; }

template <class T>
using Local = std::unique_ptr<T, Deleter<::LocalFree>>;

/// The user whose token this process has, as a string of the form S-1-5-...; empty if it cannot be found.
std::wstring this_user() {
  HANDLE opened = nullptr;
  if (::OpenProcessToken(::GetCurrentProcess(), TOKEN_QUERY, &opened) == 0) return {};
  const Handle token(opened);
  std::vector<std::byte> memory(256);
  DWORD size = 0;
  if (::GetTokenInformation(opened, TokenUser, memory.data(), static_cast<DWORD>(memory.size()), &size) == 0) return {};
  wchar_t* text = nullptr;
  if (::ConvertSidToStringSidW(reinterpret_cast<const TOKEN_USER*>(memory.data())->User.Sid, &text) == 0) return {};
  const Local<wchar_t> owned(text);
  return text;
}

/// What only this user, the administrators and the system may access, and what is created in it.
class OwnerOnly {
 public:
  OwnerOnly() {
    const std::wstring user = this_user();
    if (user.empty()) return;
    const std::wstring text = L"D:P(A;OICI;FA;;;SY)(A;OICI;FA;;;BA)(A;OICI;FA;;;" + user + L")";
    void* made = nullptr;
    if (::ConvertStringSecurityDescriptorToSecurityDescriptorW(text.c_str(), SDDL_REVISION_1, &made, nullptr) == 0)
      return;
    descriptor_.reset(made);
    attributes_.lpSecurityDescriptor = made;
  }
  explicit operator bool() const { return descriptor_ != nullptr; }
  [[nodiscard]] SECURITY_ATTRIBUTES* get() { return &attributes_; }

 private:
  Local<void> descriptor_;
  SECURITY_ATTRIBUTES attributes_{sizeof(SECURITY_ATTRIBUTES), nullptr, FALSE};
};

enum class FinalLink : std::uint8_t { follow, refuse };
enum class Names : std::uint8_t { any, one };

Handle open_file(const std::string& path, DWORD access, DWORD creation, FinalLink link,
                 SECURITY_ATTRIBUTES* security = nullptr) {
  constexpr DWORD kSharing = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
  // Without FILE_FLAG_BACKUP_SEMANTICS a folder cannot be opened, and the error would not say that it is one.
  const DWORD flags = FILE_ATTRIBUTE_NORMAL | FILE_FLAG_BACKUP_SEMANTICS |
                      (link == FinalLink::refuse ? FILE_FLAG_OPEN_REPARSE_POINT : 0U);
  return Handle(::CreateFileW(wide(path).c_str(), access, kSharing, security, creation, flags, nullptr));
}

/// Checks that `file` is a regular file; with Names::one, also that it has one hard link.
Status check_plain(const Handle& file, const std::string& path, Names names) {
  BY_HANDLE_FILE_INFORMATION facts{};
  if (::GetFileType(file.get()) != FILE_TYPE_DISK) return refused_path(path, "is not a regular file; remove it");
  if (::GetFileInformationByHandle(file.get(), &facts) == 0) return failed(path, "cannot be examined");
  if ((facts.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0)
    return refused_path(path, "is a symbolic link, which is not followed here; put the file itself there");
  if ((facts.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0)
    return refused_path(path, "is not a regular file; remove it");
  if (names == Names::one && facts.nNumberOfLinks != 1)
    return refused_path(path, "has a second hard link and may be another user's file; remove it");
  return {};
}

bool is_missing(DWORD error) { return error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND; }

/// A temporary name, unique within this process. CREATE_NEW and CreateDirectory() detect a collision with another one.
std::string beside(const std::string& path) {
  static std::atomic<unsigned> count{0};
  const fs::path whole = path_of(path);
  const std::wstring name = L"." + whole.filename().wstring().substr(0, 200) + L"." +
                            std::to_wstring(::GetCurrentProcessId()) + L"." + std::to_wstring(count++);
  return text_of(whole.parent_path() / name);
}

bool write_all(const Handle& file, std::string_view bytes) {
  while (!bytes.empty()) {
    DWORD written = 0;
    const auto part = static_cast<DWORD>(std::min<std::size_t>(bytes.size(), 1U << 20U));
    if (::WriteFile(file.get(), bytes.data(), part, &written, nullptr) == 0 || written == 0) return false;
    bytes.remove_prefix(written);
  }
  return true;
}

bool rename_file(const std::string& from, const std::string& to) {
  return ::MoveFileExW(wide(from).c_str(), wide(to).c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0;
}

Result<std::optional<std::string>> read_file(const std::string& path, FinalLink link, Names names) {
  const Handle file = open_file(path, GENERIC_READ, OPEN_EXISTING, link);
  if (!is_open(file) && is_missing(::GetLastError())) return std::optional<std::string>();
  if (!is_open(file)) return failed(path, "cannot be opened");
  if (Status s = check_plain(file, path, names); !s.ok()) return s;
  std::string text;
  std::array<char, 8192> buffer;
  for (;;) {
    DWORD n = 0;
    if (::ReadFile(file.get(), buffer.data(), static_cast<DWORD>(buffer.size()), &n, nullptr) == 0)
      return failed(path, "cannot be read");
    if (n == 0) return std::optional<std::string>(std::move(text));
    text.append(buffer.data(), n);
    if (text.size() > kMaxFileBytes)
      return Status(StatusCode::resource_exhausted, path + ": is larger than the limit of 1 MiB");
  }
}

/// The C library's descriptor of an open file, which then owns it.
FileDescriptor descriptor_of(Handle file, int flags) {
  const int number = ::_open_osfhandle(reinterpret_cast<intptr_t>(file.get()), flags);
  if (number >= 0) (void)file.release();
  return FileDescriptor(number);
}

}  // namespace

FileDescriptor::~FileDescriptor() {
  if (number_ >= 0) ::_close(number_);
}

Status make_private_folder(const std::string& path) {
  OwnerOnly owner;
  if (!owner) return failed(path, "cannot be created, its access list cannot be made");
  std::error_code error;
  if (const fs::path parent = path_of(path).parent_path(); !parent.empty()) fs::create_directories(parent, error);
  const bool made = ::CreateDirectoryW(wide(path).c_str(), owner.get()) != 0;
  if (!made && ::GetLastError() != ERROR_ALREADY_EXISTS) return failed(path, "cannot be created");
  const DWORD attributes = ::GetFileAttributesW(wide(path).c_str());
  if (attributes == INVALID_FILE_ATTRIBUTES) return failed(path, "cannot be examined");
  if ((attributes & FILE_ATTRIBUTE_DIRECTORY) == 0 || (attributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0)
    return refused_path(path,
                        "is not a folder; remove it, or, if it is a symbolic link, use the path of the folder itself");
  return {};
}

Status write_atomically(const std::string& path, std::string_view bytes, FileMode readers) {
  const DWORD there = ::GetFileAttributesW(wide(path).c_str());
  constexpr DWORD kNotRegular = FILE_ATTRIBUTE_DIRECTORY | FILE_ATTRIBUTE_DEVICE | FILE_ATTRIBUTE_REPARSE_POINT;
  if (there != INVALID_FILE_ATTRIBUTES && (there & kNotRegular) != 0)
    return refused_path(path, "is not a regular file and is not replaced; remove it or name another file");
  OwnerOnly owner;
  if (readers == FileMode::owner && !owner) return failed(path, "cannot be written, its access list cannot be made");
  std::string aside;
  Handle file;
  for (int i = 0; i < kAttempts && !is_open(file); ++i) {
    aside = beside(path);
    file = open_file(aside, GENERIC_WRITE, CREATE_NEW, FinalLink::refuse,
                     readers == FileMode::owner ? owner.get() : nullptr);
    if (!is_open(file) && ::GetLastError() != ERROR_FILE_EXISTS) break;
  }
  if (!is_open(file)) return failed(path, "cannot be written, no file can be created beside it");
  const bool written = write_all(file, bytes) && ::FlushFileBuffers(file.get()) != 0;
  const DWORD error = ::GetLastError();
  file.reset();
  if (written && rename_file(aside, path)) return {};
  const Status s = written ? failed(path, "cannot be replaced") : failed(path, "cannot be written", error);
  ::DeleteFileW(wide(aside).c_str());
  return s;
}

Result<std::optional<std::string>> read_named_file(const std::string& path) {
  return read_file(path, FinalLink::follow, Names::any);
}

Result<std::optional<std::string>> read_private_file(const std::string& path) {
  return read_file(path, FinalLink::refuse, Names::one);
}

Result<FilePointer> open_for_update(const std::string& path) {
  Handle file = open_file(path, GENERIC_READ | GENERIC_WRITE, OPEN_ALWAYS, FinalLink::follow);
  if (!is_open(file)) return failed(path, "cannot be opened");
  if (Status s = check_plain(file, path, Names::one); !s.ok()) return s;
  FileDescriptor descriptor = descriptor_of(std::move(file), _O_RDWR | _O_BINARY);
  FilePointer out(descriptor ? ::_fdopen(descriptor.get(), "r+b") : nullptr);
  if (!out) return refused_path(path, "cannot be opened: the C library has no room for another file");
  (void)descriptor.release();
  return out;
}

Result<FilePointer> open_for_reading(const std::string& path) {
  FilePointer file(::_wfopen(wide(path).c_str(), L"rb"));
  if (!file) return Status(StatusCode::not_found, path + ": " + std::strerror(errno));
  return file;
}

std::uint64_t file_position(std::FILE* file) {
  const std::int64_t position = ::_ftelli64(file);
  return position < 0 ? 0 : static_cast<std::uint64_t>(position);
}

bool is_disk_full(int error) { return error == ENOSPC || error == EFBIG; }

std::string configuration_folder() {
  const wchar_t* const value = ::_wgetenv(L"LOCALAPPDATA");
  return value == nullptr ? std::string() : text_of(value);
}

Status truncate_file(std::FILE* file, std::uint64_t bytes) {
  const auto size = static_cast<std::int64_t>(bytes);
  if (std::fflush(file) == 0 && ::_chsize_s(::_fileno(file), size) == 0 && ::_fseeki64(file, size, SEEK_SET) == 0)
    return {};
  const int error = errno;
  return {is_disk_full(error) ? StatusCode::resource_exhausted : StatusCode::failed_precondition,
          std::string("the file: cannot be truncated: ") + std::strerror(error)};
}

Result<std::string> make_folder_beside(const std::string& path) {
  OwnerOnly owner;
  if (!owner) return failed(path, "no folder can be created beside it, its access list cannot be made");
  for (int i = 0; i < kAttempts; ++i) {
    std::string name = beside(path);
    if (::CreateDirectoryW(wide(name).c_str(), owner.get()) != 0) return name;
    if (::GetLastError() != ERROR_ALREADY_EXISTS) break;
  }
  return failed(path, "no folder can be created beside it");
}

Status replace_folder(const std::string& made, const std::string& path) {
  const std::string old = beside(path);
  const bool moved = rename_file(path, old);
  if (!moved && !is_missing(::GetLastError())) return failed(path, "cannot be replaced");
  if (!rename_file(made, path)) {
    const Status s = failed(path, "cannot be replaced");
    if (moved) (void)rename_file(old, path);
    return s;
  }
  std::error_code ignored;
  if (moved) fs::remove_all(path_of(old), ignored);
  return {};
}

Result<FolderLock> FolderLock::take(const std::string& folder) {
  const std::string path = folder + "/lock";
  OwnerOnly owner;
  if (!owner) return failed(path, "cannot be created, its access list cannot be made");
  Handle file = open_file(path, GENERIC_READ | GENERIC_WRITE, OPEN_ALWAYS, FinalLink::refuse, owner.get());
  if (!is_open(file)) return failed(path, "cannot be opened");
  if (Status s = check_plain(file, path, Names::one); !s.ok()) return s;
  OVERLAPPED whole{};
  if (::LockFileEx(file.get(), LOCKFILE_EXCLUSIVE_LOCK, 0, 1, 0, &whole) == 0) return failed(path, "cannot be locked");
  FileDescriptor lock = descriptor_of(std::move(file), _O_RDWR | _O_BINARY);
  if (!lock) return refused_path(path, "cannot be locked: the C library has no room for another file");
  return FolderLock(std::move(lock));
}

}  // namespace lightwell
