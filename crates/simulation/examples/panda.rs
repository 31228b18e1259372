//! Renders the arm in its ready pose by an outside camera and by the wrist camera.
//!
//! `cargo run --release -p sdg-simulation --example panda FOLDER`

use std::path::PathBuf;
use std::sync::Arc;

use sdg_simulation::{ArmVector, Data, Model, PandaIds, RenderConfig, Renderer, panda_asset};

const XML: &str = "<mujoco><compiler angle='radian'/><include file='panda.xml'/>\
<visual><headlight ambient='.35 .35 .35' diffuse='.25 .25 .25' specular='0 0 0'/><map znear='0.01'/><quality shadowsize='2048'/></visual>\
<statistic center='0.3 0 0.3' extent='1.2'/>\
<asset><texture type='skybox' builtin='gradient' rgb1='.75 .78 .82' rgb2='.45 .48 .52' width='128' height='512'/></asset>\
<worldbody><light pos='0.8 -0.8 2.0' dir='-0.3 0.4 -1' diffuse='.6 .6 .6' castshadow='true'/>\
<geom type='box' size='0.6 0.6 0.02' pos='0.4 0 -0.02' rgba='.6 .5 .4 1'/>\
<geom type='plane' size='5 5 1' pos='0 0 -0.75' rgba='.5 .5 .52 1'/>\
<camera name='front' pos='1.75 -0.95 0.85' xyaxes='0.52 0.86 0 -0.28 0.17 0.95' fovy='40'/>\
<camera name='side' pos='0.3 -1.9 0.45' xyaxes='1 0 0 0 0.1 1' fovy='40'/></worldbody></mujoco>";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: panda FOLDER")?);
    let model = Arc::new(Model::from_xml(XML, &[panda_asset()])?);
    let panda = PandaIds::find(&model)?;
    let mut data = Data::new(model.clone())?;
    let s = std::f64::consts::FRAC_PI_4;
    panda.set_position(&mut data, &ArmVector::from([0.0, -s, 0.0, -3.0 * s, 0.0, 2.0 * s, s]));
    panda.set_finger_position_m(&mut data, 0.03);
    data.forward()?;
    let mut renderer = Renderer::new(&model, RenderConfig { shadow_size: 2048, ..RenderConfig::default() })?;
    for name in ["front", "side", "wrist"] {
        let started = std::time::Instant::now();
        let image = renderer.image(&mut data, model.id(name)?)?;
        println!("{name}: {:.0} ms", started.elapsed().as_secs_f64() * 1e3);
        image.save(folder.join(format!("{name}.png")))?;
    }
    Ok(())
}
