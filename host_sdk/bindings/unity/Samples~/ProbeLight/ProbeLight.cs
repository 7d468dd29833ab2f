using Lightwell;
using Lightwell.Managed;
using UnityEngine;
using UnityEngine.Rendering;

/// <summary>Lights the scene by a probe: the ambient probe, and the directional light of the same object. The world has
/// the probe's axes, with +Z where the probe's -Z is.</summary>
[RequireComponent(typeof(Light))]
public sealed class ProbeLight : MonoBehaviour
{
    public string address = "wss://probe.local";
    public string token = "";
    /// <summary>Factor of every colour: Lightwell's units are cd/m² and lux, or relative ones.</summary>
    public float exposure = 1;

    private ManagedProbe probe;
    private bool enabledNow;

    private async void OnEnable()
    {
        enabledNow = true;
        try
        {
            var made = await ManagedProbe.ConnectAsync(address,
                new ManagedProbeOptions { Token = token == "" ? null : token });
            if (enabledNow) probe = made;
            else made.Dispose();
        }
        catch (LightwellException e)
        {
            Debug.LogError("Lightwell: " + e.Message, this);
        }
    }

    private void OnDisable()
    {
        enabledNow = false;
        if (probe != null) probe.Dispose();
        probe = null;
    }

    private void Update()
    {
        if (probe == null) return;
        var light = probe.Latest();
        if (light.Validity != Validity.Valid) return;
        var unity = light.ToUnity(UnityPipeline.Universal, MainLight.Apart, exposure);
        var ambient = new SphericalHarmonicsL2();
        for (var rgb = 0; rgb < 3; ++rgb)
            for (var i = 0; i < 9; ++i) ambient[rgb, i] = unity.SphericalHarmonicsL2[9 * rgb + i];
        RenderSettings.ambientMode = AmbientMode.Custom;
        RenderSettings.ambientProbe = ambient;
        var sun = GetComponent<Light>();
        transform.forward = new Vector3(unity.Forward.X, unity.Forward.Y, unity.Forward.Z);
        sun.color = new Color(unity.Color.R, unity.Color.G, unity.Color.B).gamma;
        sun.intensity = unity.Intensity;
    }
}
