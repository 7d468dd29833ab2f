// SIGPIPE, which a POSIX system sends to a thread that writes to a connection whose other end is closed, and which ends
// the process by default. Other systems have no such signal, and the functions do nothing there.
#pragma once

#include <functional>

namespace lightwell {

/// Blocks SIGPIPE in the calling thread.
void block_pipe_signal();

/// Calls `function`, which may change what the process does at SIGPIPE, and restores that.
void keep_pipe_signal(const std::function<void()>& function);

}  // namespace lightwell
