using System;
using UnityEngine;
using UnityEngine.Rendering;

/// <summary>Sets the scene's light probes, and lights, from a file of `lightwell field --grid`. The scene needs a Light
/// Probe Group that was baked once: its positions stay, its light is replaced. This object is at the grid's origin; its
/// rotation and scale do not count.</summary>
public sealed class LightGridProbes : MonoBehaviour
{
    public TextAsset file;
    /// <summary>Factor of every colour: Lightwell's units are cd/m² and lux, or relative ones.</summary>
    public float exposure = 1;
    /// <summary>HDRP's lights are in candela and lux.</summary>
    public bool highDefinition;

    /// <summary>Light probes of the last OnEnable() that have light of the grid; the others keep theirs.</summary>
    public int Lit { get; private set; }

    private void OnEnable()
    {
        LightGrid grid;
        try
        {
            grid = LightGrid.Parse(file.text);
        }
        catch (FormatException e)
        {
            Debug.LogError("Lightwell: " + e.Message, this);
            return;
        }
        var probes = LightmapSettings.lightProbes;
        if (probes == null)
        {
            Debug.LogError("Lightwell: the scene has no light probes: add a Light Probe Group and bake it", this);
            return;
        }
        var places = probes.positions;
        var light = probes.bakedProbes;
        Lit = 0;
        for (var i = 0; i < places.Length; ++i)
        {
            SphericalHarmonicsL2 harmonics;
            if (!grid.Sample(places[i] - transform.position, out harmonics)) continue;
            light[i] = harmonics * exposure;
            ++Lit;
        }
        probes.bakedProbes = light;
        if (transform.childCount == 0)
            foreach (var apart in grid.lights) Add(apart);
    }

    private void Add(LightGrid.ApartLight apart)
    {
        var child = new GameObject("Light").transform;
        child.SetParent(transform, false);
        child.localPosition = VectorOf(apart.position);
        child.forward = VectorOf(apart.forward);
        var light = child.gameObject.AddComponent<Light>();
        light.type = apart.type == "Point" ? LightType.Point : LightType.Directional;
        light.color = new Color(apart.color[0], apart.color[1], apart.color[2]).gamma;
        light.intensity = apart.intensity * exposure * (highDefinition ? Mathf.PI : 1);
        light.range = 100; // m; URP lets the inverse square fall to zero there.
        light.shadows = LightShadows.Soft;
    }

    private static Vector3 VectorOf(float[] v) => new Vector3(v[0], v[1], v[2]);
}
