// Lights an Unreal level by a Lightwell probe: a component of the plug-in or game module that links liblightwell.
#pragma once

#include <memory>
#include <optional>

#include <lightwell/lightwell_c.hpp>

#include "Components/ActorComponent.h"
#include "CoreMinimal.h"
#include "LightwellLightComponent.generated.h"

class UDirectionalLightComponent;
class USkyLightComponent;

/// Sets a directional light (lux, direction, colour, angle) to the probe's main light, and the intensity and colour of
/// a sky light to the rest. The world's X is the probe's forward (-Z), Y its right, Z its up.
UCLASS(ClassGroup = (Lights), meta = (BlueprintSpawnableComponent))
class ULightwellLightComponent : public UActorComponent {
  GENERATED_BODY()

 public:
  ULightwellLightComponent();

  /// ws://, wss://, grpc://, grpcs:// or usb:, as lw_probe_connect() takes.
  UPROPERTY(EditAnywhere, Category = "Lightwell")
  FString Address = TEXT("wss://probe.local");
  /// Factor on all light, above 0.
  UPROPERTY(EditAnywhere, Category = "Lightwell")
  float Gain = 1.0F;
  UPROPERTY(EditAnywhere, Category = "Lightwell")
  TObjectPtr<UDirectionalLightComponent> Sun;
  UPROPERTY(EditAnywhere, Category = "Lightwell")
  TObjectPtr<USkyLightComponent> Sky;

  void BeginPlay() override;
  void EndPlay(const EEndPlayReason::Type Reason) override;
  void TickComponent(float DeltaTime, ELevelTick Tick, FActorComponentTickFunction* Function) override;

  /// Colour temperature of all light, K; 0 where it has no meaning.
  UFUNCTION(BlueprintPure, Category = "Lightwell")
  float GetColorTemperature() const { return ColorTemperature; }

 private:
  struct FConnection;
  void Show(const lw::Lighting& Light);

  std::shared_ptr<FConnection> Connection;
  float ColorTemperature = 0;
};
