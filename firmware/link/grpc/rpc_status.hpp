// Converts a Status to a gRPC status.
#pragma once

#include <grpcpp/support/status.h>

#include <lightwell/result.hpp>

namespace lightwell {

[[nodiscard]] inline grpc::Status rpc_status(const Status& s) {
  switch (s.code()) {
    case StatusCode::ok:
      return grpc::Status::OK;
    case StatusCode::invalid_argument:
      return {grpc::StatusCode::INVALID_ARGUMENT, s.message()};
    case StatusCode::not_found:
      return {grpc::StatusCode::NOT_FOUND, s.message()};
    case StatusCode::data_loss:
      return {grpc::StatusCode::DATA_LOSS, s.message()};
    case StatusCode::failed_precondition:
      return {grpc::StatusCode::FAILED_PRECONDITION, s.message()};
    case StatusCode::unavailable:
      return {grpc::StatusCode::UNAVAILABLE, s.message()};
    case StatusCode::resource_exhausted:
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, s.message()};
    case StatusCode::internal:
      break;
  }
  return {grpc::StatusCode::INTERNAL, s.message()};
}

}  // namespace lightwell
