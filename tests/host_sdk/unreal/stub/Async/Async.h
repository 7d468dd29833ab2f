#pragma once

#include <thread>
#include <utility>

namespace ENamedThreads {
enum Type { AnyBackgroundThreadNormalTask };
}

template <class Function>
void AsyncTask(ENamedThreads::Type, Function&& Task) {
  std::thread(std::forward<Function>(Task)).detach();
}
