#pragma once
/// \file What a scene's table cannot say: conditions between keys.

#include "core/yaml/schema.hpp"

namespace hemowalk::data {

/// Adds every violated condition of a validated (perhaps partly invalid) scene to \p problems.
void check_scene(const yaml::Value& scene, yaml::Problems& problems);

}  // namespace hemowalk::data
