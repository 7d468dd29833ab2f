// The part of Unreal Engine 5 that examples/unreal_light uses, with its signatures, so that the component is compiled
// and run without Unreal.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>

#define UCLASS(...)
#define UPROPERTY(...)
#define UFUNCTION(...)
#define GENERATED_BODY() using Super = UActorComponent;
#define TEXT(text) text
#define TCHAR_TO_UTF8(text) text
#define UTF8_TO_TCHAR(text) text
#define UE_LOG(Category, Verbosity, ...) (void)std::printf(__VA_ARGS__)

class FString {
 public:
  FString(const char* Text) : Value(Text) {}  // NOLINT: meant to be implicit
  const char* operator*() const { return Value.c_str(); }

 private:
  std::string Value;
};

/// Degrees.
struct FRotator {
  double Pitch, Yaw, Roll;
};

struct FVector {
  double X, Y, Z;

  FVector(double InX, double InY, double InZ) : X(InX), Y(InY), Z(InZ) {}
  [[nodiscard]] FRotator Rotation() const {
    constexpr double Degrees = 57.29577951308232;
    return {std::atan2(Z, std::hypot(X, Y)) * Degrees, std::atan2(Y, X) * Degrees, 0};
  }
};

struct FLinearColor {
  float R, G, B, A = 1;

  FLinearColor(float InR, float InG, float InB) : R(InR), G(InG), B(InB) {}
};

template <class T>
class TObjectPtr {
 public:
  TObjectPtr& operator=(T* Other) {
    Pointer = Other;
    return *this;
  }
  explicit operator bool() const { return Pointer != nullptr; }
  T* operator->() const { return Pointer; }

 private:
  T* Pointer = nullptr;
};
