// Relief mapping as a material of Bevy. SPDX-License-Identifier: MIT-0
use bevy::image::{ImageAddressMode, ImageFilterMode, ImageLoaderSettings, ImageSampler, ImageSamplerDescriptor};
use bevy::prelude::*;
use bevy::render::render_resource::AsBindGroup;
use bevy::shader::ShaderRef;

#[derive(Asset, TypePath, AsBindGroup, Clone)]
pub struct ReliefMaterial {
    /// xyz: towards the light, in the world; w: depth of the relief, in sides of a tile
    #[uniform(0)]
    pub light_and_depth: Vec4,
?map     #[texture(1)]
?map     #[sampler(2)]
?map     pub relief_map: Handle<Image>,
?extra     #[texture(3)]
?extra     pub extra_map: Handle<Image>,
}

impl Material for ReliefMaterial {
    fn fragment_shader() -> ShaderRef {
        "relief/relief_material.wgsl".into()
    }
}

impl ReliefMaterial {
?map     pub fn load(assets: &AssetServer) -> Self {
!map     pub fn load(_assets: &AssetServer) -> Self {
?map         let texture = |file: &'static str| {
?map             assets.load_with_settings(file, |settings: &mut ImageLoaderSettings| {
?map                 settings.is_srgb = false;
?map                 settings.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
?repeat                     address_mode_u: ImageAddressMode::Repeat,
?repeat                     address_mode_v: ImageAddressMode::Repeat,
?edge                     address_mode_u: ImageAddressMode::ClampToEdge,
?edge                     address_mode_v: ImageAddressMode::ClampToEdge,
?map                     mag_filter: ImageFilterMode::Linear,
?map                     min_filter: ImageFilterMode::Linear,
?map                     mipmap_filter: ImageFilterMode::Nearest,
?map                     ..default()
?map                 });
?map             })
?map         };
        Self {
            light_and_depth: Vec3::new(0.4, 0.8, 0.4).normalize().extend(@depth@),
?map             relief_map: texture("relief/@relief_file@"),
?extra             extra_map: texture("relief/@extra_file@"),
        }
    }
}
