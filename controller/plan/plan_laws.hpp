// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/law/registry/law_registry.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/plan_device.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

/// The laws that a scene names. Throws SceneError for one that this program does not know.
template <class N>
void plan_laws(const LoadedScene& scene, ServoPlan<N>& plan) {
  const LawLoop loop{.rate_hz = double(scene.servo.rate_hz),
                     .tip_noise_mm = device_parts::tip_noise_mm(scene.device.personality)};
  const auto law = [&]<template <class> class In>(const LawChoice& choice, const char* key,
                                                  LawPlan<In<N>, typename N::Real>& into) {
    try {
      into = plan_law<In, N>(choice, loop);
    } catch (const LawError& error) {
      throw SceneError(scene.path + ": " + key + " \"" + choice.name + '"' + error.what());
    }
  };
  law.template operator()<ForceInput>(scene.force.law, "force.law", plan.force_law);
  law.template operator()<VelocityInput>(scene.servo.velocity, "servo.velocity", plan.velocity);
  law.template operator()<StabiliserInput>(scene.force.stabiliser, "force.stabiliser",
                                           plan.stabiliser);
}

}  // namespace kerf
