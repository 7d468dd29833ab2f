#include "LightwellLightComponent.h"

#include <algorithm>
#include <atomic>
#include <string>

#include <lightwell/conventions.h>
#include <lightwell/light_estimate.h>

#include "Async/Async.h"
#include "Components/DirectionalLightComponent.h"
#include "Components/SkyLightComponent.h"

/// Filled by a task, because connecting takes up to two seconds; the game thread reads it once bReady is set.
struct ULightwellLightComponent::FConnection {
  std::optional<lw::Probe> Probe;
  std::optional<lw::Lighting> Light;
  std::string Error;
  std::atomic<bool> bReady{false};
};

ULightwellLightComponent::ULightwellLightComponent() { PrimaryComponentTick.bCanEverTick = true; }

void ULightwellLightComponent::BeginPlay() {
  Super::BeginPlay();
  Connection = std::make_shared<FConnection>();
  const std::string Uri(TCHAR_TO_UTF8(*Address));
  AsyncTask(ENamedThreads::AnyBackgroundThreadNormalTask, [Made = Connection, Uri] {
    auto Probe = lw::Probe::connect(Uri);
    auto Light = lw::Lighting::create();
    if (Probe && Light) {
      Made->Probe.emplace(std::move(*Probe));
      Made->Light.emplace(std::move(*Light));
    } else {
      Made->Error = Probe ? Light.status().message : Probe.status().message;
    }
    Made->bReady = true;
  });
}

void ULightwellLightComponent::EndPlay(const EEndPlayReason::Type Reason) {
  Connection.reset();
  Super::EndPlay(Reason);
}

void ULightwellLightComponent::TickComponent(float DeltaTime, ELevelTick Tick, FActorComponentTickFunction* Function) {
  Super::TickComponent(DeltaTime, Tick, Function);
  if (!Connection || !Connection->bReady) return;
  if (!Connection->Error.empty()) {
    UE_LOG(LogTemp, Error, TEXT("Lightwell: %s"), UTF8_TO_TCHAR(Connection->Error.c_str()));
    Connection.reset();
    return;
  }
  // Lock-free: never waits for the network.
  if (Connection->Probe->latest(*Connection->Light).ok()) Show(*Connection->Light);
}

void ULightwellLightComponent::Show(const lw::Lighting& Light) {
  float Weight = 0;
  auto Options = lw::sized<lw_light_estimate_options>();
  auto Estimate = lw::sized<lw_light_estimate>();
  (void)lw_lighting_fade_weight(Light.get(), 250'000'000, 500'000'000, &Weight);
  (void)lw_light_estimate_defaults(&Options);
  Options.gain = Gain;
  if (lw_lighting_estimate(Light.get(), &Options, &Estimate) != LW_OK) return;
  auto Unreal = lw::sized<lw_unreal>();
  if (lw_lighting_to_unreal(Light.get(), LW_MAIN_LIGHT_APART, nullptr, &Unreal) != LW_OK) return;
  ColorTemperature = Estimate.color_temperature;
  if (Sun) {
    const float* const F = Unreal.forward;
    const float* const C = Unreal.color;
    Sun->SetWorldRotation(FVector(F[0], F[1], F[2]).Rotation());
    Sun->SetLightColor(FLinearColor(C[0], C[1], C[2]));
    Sun->SetIntensity(Weight * Gain * Unreal.intensity);
    Sun->SetLightSourceAngle(Unreal.lightSourceAngle);
  }
  if (Sky) {
    // Luminance of the harmonics' mean, cd/m². A sky light has one colour: direction and colour of the surroundings are
    // lost.
    constexpr float Y00 = 0.282095F;
    const float Mean[3] = {Unreal.R[0] * Y00, Unreal.G[0] * Y00, Unreal.B[0] * Y00};
    const float Most = std::max({Mean[0], Mean[1], Mean[2], 1e-9F});
    const auto Part = [&](float V) { return std::max(V, 0.0F) / Most; };
    Sky->SetLightColor(FLinearColor(Part(Mean[0]), Part(Mean[1]), Part(Mean[2])));
    Sky->SetIntensity(Weight * Gain * Most);
  }
}
