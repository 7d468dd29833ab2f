using System;
using Godot;
using Lightwell;
using Lightwell.Managed;
using Environment = Godot.Environment;

/// <summary>Lights a Godot 4 scene by a probe: this DirectionalLight3D is its main light, and the panorama sky of
/// `Surroundings` is the rest, for ambient light and reflections. Godot's axes are the probe's. A white surface that
/// faces an illuminance of NeutralIlluminance has the value 1.</summary>
public partial class ProbeLight : DirectionalLight3D
{
    [Export] public string Address = "wss://probe.local";
    [Export] public string Token = "";
    [Export] public float NeutralIlluminance = 1000;
    /// <summary>Its sky is replaced.</summary>
    [Export] public Environment Surroundings;

    private const int Width = 32, Height = 16;

    private readonly byte[] texels = new byte[Width * Height * 3 * sizeof(float)];
    private readonly float[] values = new float[Width * Height * 3];
    private readonly ImageTexture texture = new ImageTexture();
    private ManagedProbe probe;
    private ulong shown;

    public override async void _EnterTree()
    {
        try
        {
            var made = await ManagedProbe.ConnectAsync(Address,
                new ManagedProbeOptions { Token = Token == "" ? null : Token });
            if (IsInsideTree()) probe = made;
            else made.Dispose();
        }
        catch (LightwellException e)
        {
            GD.PushError("Lightwell: " + e.Message);
        }
    }

    public override void _ExitTree()
    {
        if (probe != null) probe.Dispose();
        probe = null;
    }

    public override void _Process(double delta)
    {
        if (probe == null) return;
        var light = probe.Latest();
        var weight = Fade.Weight(light);
        if (light.Descriptor == null || (light.Descriptor.Sequence == shown && weight == 1)) return;
        shown = light.Descriptor.Sequence;
        Show(light.Estimate(neutralIlluminance: NeutralIlluminance), weight);
    }

    /// <summary>Sets light and sky; `weight` fades both.</summary>
    public void Show(ManagedLightEstimate e, float weight)
    {
        LightEnergy = 0;
        if (e.MainLightLumens > 0)
        {
            // LightEnergy times LightColor is the value of a white surface that faces the light.
            LightEnergy = weight * e.MainLightLumens / 1000 / e.MainLightColor.Luminance;
            LightColor = new Color(e.MainLightColor.R, e.MainLightColor.G, e.MainLightColor.B).LinearToSrgb();
            var d = e.MainLightDirection;
            // It shines along its -Z: away from the light.
            var up = Math.Abs(d.Y) < 0.99f ? Vector3.Up : Vector3.Right;
            LookAtFromPosition(Vector3.Zero, new Vector3(-d.X, -d.Y, -d.Z), up);
        }
        if (Surroundings == null) return;
        Paint(e.AmbientSphericalHarmonics, (float)(Math.PI / NeutralIlluminance) * weight);
        var image = Image.CreateFromData(Width, Height, false, Image.Format.Rgbf, texels);
        texture.SetImage(image);
        var sky = Surroundings.Sky ?? (Surroundings.Sky = new Sky());
        var material = sky.SkyMaterial as PanoramaSkyMaterial ?? new PanoramaSkyMaterial();
        material.Panorama = texture;
        sky.SkyMaterial = material;
        Surroundings.BackgroundMode = Environment.BGMode.Sky;
        Surroundings.AmbientLightSource = Environment.AmbientSource.Sky;
    }

    /// <summary>The radiance of nine coefficients as an equirectangular picture: -Z at its edges, +Y on top.</summary>
    private void Paint(Rgb[] h, float scale)
    {
        for (var row = 0; row < Height; ++row)
            for (var column = 0; column < Width; ++column)
            {
                double phi = 2 * Math.PI * (column + 0.5) / Width, theta = Math.PI * (row + 0.5) / Height;
                double x = Math.Sin(theta) * Math.Sin(phi), y = Math.Cos(theta), z = -Math.Sin(theta) * Math.Cos(phi);
                // Real spherical harmonics, all signs positive (Ramamoorthi and Hanrahan 2001, equation 3).
                var basis = new[]
                {
                    0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z,
                    0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y)
                };
                double r = 0, g = 0, b = 0;
                for (var i = 0; i < 9; ++i)
                {
                    r += h[i].R * basis[i];
                    g += h[i].G * basis[i];
                    b += h[i].B * basis[i];
                }
                var at = 3 * (row * Width + column);
                values[at] = (float)Math.Max(0, scale * r);
                values[at + 1] = (float)Math.Max(0, scale * g);
                values[at + 2] = (float)Math.Max(0, scale * b);
            }
        Buffer.BlockCopy(values, 0, texels, 0, texels.Length);
    }
}
