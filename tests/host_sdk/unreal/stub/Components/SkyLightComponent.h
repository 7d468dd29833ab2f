#pragma once

#include "CoreMinimal.h"

class USkyLightComponent {
 public:
  void SetLightColor(const FLinearColor& In) { Color = In; }
  void SetIntensity(float In) { Intensity = In; }

  FLinearColor Color{0, 0, 0};
  float Intensity = -1;
};
