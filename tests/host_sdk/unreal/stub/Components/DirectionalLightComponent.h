#pragma once

#include "CoreMinimal.h"

class UDirectionalLightComponent {
 public:
  void SetWorldRotation(const FRotator& In) { Rotation = In; }
  void SetLightColor(const FLinearColor& In, bool /*bSRGB*/ = true) { Color = In; }
  void SetIntensity(float In) { Intensity = In; }
  void SetLightSourceAngle(float In) { Angle = In; }

  FRotator Rotation{};
  FLinearColor Color{0, 0, 0};
  float Intensity = -1, Angle = -1;
};
